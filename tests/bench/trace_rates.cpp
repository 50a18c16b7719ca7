// Rays per second of Tracer against Embree called with nothing around it: the same rays, the same process, turn by
// turn, one thread, medians of processor time. One JSON line a case.
//   kiln_trace_rates [packets] [rounds]

#include <embree3/rtcore.h>

#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "core/artifact/import.h"
#include "core/base/random.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"
#include "core/trace/tracer.h"
#include "tests/bench/bench.h"

namespace kiln::bench {
namespace {

constexpr int kRaysPerPoint = 256;

/// The opaque triangles in an Embree scene of their own.
class Bare {
 public:
  Bare(const Scene& scene, bool robust) : device_(rtcNewDevice(nullptr)), world_(rtcNewScene(device_)) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    const Mesh& mesh = scene.mesh;
    std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                        mesh.position.size()),
                mesh.position.data(), mesh.position.size() * sizeof(Vec3f));
    std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle),
                                        mesh.triangles.size()),
                mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(world_, geometry);
    rtcReleaseGeometry(geometry);
    if (robust) rtcSetSceneFlags(world_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(world_);
  }
  ~Bare() {
    rtcReleaseScene(world_);
    rtcReleaseDevice(device_);
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;

  RTCScene world() const { return world_; }

 private:
  RTCDevice device_;
  RTCScene world_;
};

/// Packet, and the number of its hits: what a bare loop needs and no more.
template <int N, class Ray>
void fill(Ray& ray, const Rays16& from, int lane) {
  const auto copy = [&](float* to, const std::array<float, kPacket>& values) {
    std::memcpy(to, values.data() + lane, N * sizeof(float));
  };
  copy(ray.org_x, from.ox), copy(ray.org_y, from.oy), copy(ray.org_z, from.oz);
  copy(ray.dir_x, from.dx), copy(ray.dir_y, from.dy), copy(ray.dir_z, from.dz), copy(ray.tfar, from.far);
}

template <int N, class Ray, class Query>
std::uint64_t bare_occluded(const std::vector<Rays16>& packets, const Query& query) {
  Ray ray{};
  alignas(64) int valid[N];
  std::fill_n(valid, N, -1);
  std::fill_n(ray.mask, N, ~0U);
  std::uint64_t hits = 0;
  for (const Rays16& packet : packets) {
    for (int lane = 0; lane < kPacket; lane += N) {
      fill<N>(ray, packet, lane);
      query(valid, ray);
      for (int i = 0; i < N; ++i) hits += ray.tfar[i] < 0;
    }
  }
  return hits;
}

template <int N, class RayHit, class Query>
std::uint64_t bare_closest(const std::vector<Rays16>& packets, const Query& query) {
  RayHit ray{};
  alignas(64) int valid[N];
  std::fill_n(valid, N, -1);
  std::fill_n(ray.ray.mask, N, ~0U);
  std::uint64_t hits = 0;
  for (const Rays16& packet : packets) {
    for (int lane = 0; lane < kPacket; lane += N) {
      fill<N>(ray.ray, packet, lane);
      std::fill_n(ray.hit.geomID, N, RTC_INVALID_GEOMETRY_ID);
      query(valid, ray);
      for (int i = 0; i < N; ++i) hits += ray.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    }
  }
  return hits;
}

/// Cosine-distributed rays from points of the surface, triangle by triangle.
std::vector<Rays16> surface_rays(const Scene& scene, std::size_t count) {
  std::vector<Rays16> packets(count);
  const std::size_t points = count * kPacket / kRaysPerPoint + 1;
  for (std::size_t k = 0; k < count * kPacket; ++k) {
    const std::size_t point = k / kRaysPerPoint;
    const auto triangle = static_cast<std::uint32_t>(point * scene.mesh.triangles.size() / points);
    const SurfacePoint p = surface_point(scene, triangle, 0.3F, 0.3F);
    const Vec3f local = cosine_hemisphere(sobol_owen(static_cast<std::uint32_t>(k % kRaysPerPoint), point));
    const Vec3f d = normalized(basis_around(p.geometric_normal).to_world(local));
    const Vec3f o = offset_origin(p.position, p.geometric_normal);
    Rays16& rays = packets[k / kPacket];
    const std::size_t i = k % kPacket;
    rays.ox[i] = o.x, rays.oy[i] = o.y, rays.oz[i] = o.z;
    rays.dx[i] = d.x, rays.dy[i] = d.y, rays.dz[i] = d.z;
    rays.far[i] = 4;
  }
  return packets;
}

struct Contender {
  std::string name;
  std::function<std::uint64_t()> run;
  std::vector<double> seconds;
  std::uint64_t hits = 0;
};

void measure(const std::string& name, const Scene& scene, std::size_t packets, int rounds) {
  const std::vector<Rays16> rays = surface_rays(scene, packets);
  Threads threads(1);
  const double before = process_seconds();
  const Tracer tracer(scene, threads);
  const double build = process_seconds() - before;
  const Bare plain(scene, false), robust(scene, true);
  const auto context = [] {
    RTCIntersectContext c;
    rtcInitIntersectContext(&c);
    return c;
  };
  RTCIntersectContext shared = context();
  const auto occluded = [&](const Bare& bare) {
    return [&] {
      return bare_occluded<16, RTCRay16>(rays,
                                         [&](int* v, RTCRay16& r) { rtcOccluded16(v, bare.world(), &shared, &r); });
    };
  };
  const auto closest = [&](const Bare& bare) {
    return [&] {
      return bare_closest<16, RTCRayHit16>(
          rays, [&](int* v, RTCRayHit16& r) { rtcIntersect16(v, bare.world(), &shared, &r); });
    };
  };
  std::vector<Contender> all{
      {"occluded16, ours",
       [&] {
         std::uint64_t hits = 0;
         for (const Rays16& packet : rays) hits += static_cast<unsigned>(__builtin_popcount(tracer.occluded16(packet)));
         return hits;
       },
       {}},
      {"occluded16, Embree", occluded(plain), {}},
      {"occluded16, Embree robust", occluded(robust), {}},
      {"occluded8, Embree",
       [&] {
         return bare_occluded<8, RTCRay8>(rays,
                                          [&](int* v, RTCRay8& r) { rtcOccluded8(v, plain.world(), &shared, &r); });
       },
       {}},
      {"closest16, ours",
       [&] {
         std::uint64_t hits = 0;
         Hits16 found;
         for (const Rays16& packet : rays) {
           tracer.closest16(packet, found);
           for (const std::uint32_t t : found.triangle) hits += t != kNoHit;
         }
         return hits;
       },
       {}},
      {"closest16, Embree", closest(plain), {}},
      {"closest16, Embree robust", closest(robust), {}},
      {"closest8, Embree",
       [&] {
         return bare_closest<8, RTCRayHit8>(
             rays, [&](int* v, RTCRayHit8& r) { rtcIntersect8(v, plain.world(), &shared, &r); });
       },
       {}},
  };
  for (int round = 0; round < rounds; ++round) {
    for (Contender& c : all) {
      const double start = thread_seconds();
      c.hits = c.run();
      c.seconds.push_back(thread_seconds() - start);
    }
  }
  const auto total = static_cast<double>(packets * kPacket);
  for (const Contender& c : all) {
    const double seconds = median(c.seconds);
    std::printf(
        "{\"bench\":\"trace_rates\",\"scene\":\"%s\",\"triangles\":%zu,\"case\":\"%s\",\"rays\":%.0f,\"seconds\":%.4f,"
        "\"mrays_per_s\":%.2f,\"hit\":%.4f,\"build_seconds\":%.3f}\n",
        name.c_str(), scene.mesh.triangles.size(), c.name.c_str(), total, seconds, total / seconds * 1e-6,
        static_cast<double>(c.hits) / total, build);
  }
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  const std::size_t packets = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 16384;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 7;
  const std::string models = std::string(KILN_SHARED) + "/models/";
  const char* files[][2] = {{"cornell", "references/cornell.glb"},
                            {"bunny", "references/bunny.glb"},
                            {"dungeon", "scenes/dungeon-interior/level-dungeon.gltf"}};
  for (const auto& [name, path] : files) {
    const auto loaded = read_scene_files(models + path);
    const auto scene = loaded ? import_scene(*loaded) : Result<Scene>(fault("missing", "no such model"));
    if (!scene) {
      std::fprintf(stderr, "%s: %s\n", name, scene.error().message.c_str());
      continue;
    }
    bench::measure(name, *scene, packets, rounds);
  }
}
