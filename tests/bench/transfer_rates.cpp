// Rays per second of transfer and of an interreflection pass, against the same rays sent to Embree with nothing else
// done: in one process, turn by turn, medians. One JSON line for each scene and kind.
//   kiln_transfer_rates [points] [rounds] [scene]

#include <embree3/rtcore.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

#include "core/prt/gather.h"
#include "core/prt/interreflection.h"
#include "core/prt/morton.h"
#include "core/prt/subdivide.h"
#include "core/sphere/sh.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/reference_set.h"
#include "tests/core/prt/test_scenes.h"

// Every allocation of our code is counted, so that the peak does not depend on what the system keeps or takes back.
static std::atomic<std::size_t> held_bytes = 0, peak_bytes = 0;

static void* count_new(void* p) {
  if (p == nullptr) throw std::bad_alloc();
  const std::size_t now = held_bytes += malloc_usable_size(p);
  for (std::size_t peak = peak_bytes; peak < now && !peak_bytes.compare_exchange_weak(peak, now);) {
  }
  return p;
}
static void count_delete(void* p) noexcept {
  held_bytes -= malloc_usable_size(p);
  free(p);
}
void* operator new(std::size_t size) { return count_new(malloc(size)); }
void* operator new(std::size_t size, std::align_val_t align) {
  const auto a = static_cast<std::size_t>(align);
  return count_new(aligned_alloc(a, (size + a - 1) / a * a));
}
void operator delete(void* p) noexcept { count_delete(p); }
void operator delete(void* p, std::size_t) noexcept { count_delete(p); }
void operator delete(void* p, std::align_val_t) noexcept { count_delete(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { count_delete(p); }

namespace kiln::bench {
namespace {

constexpr std::size_t kBlock = 64;

// Embree with the scene's triangles, set up as core/trace does, without material filters.
class BareEmbree {
 public:
  explicit BareEmbree(const Scene& scene) : device_(rtcNewDevice(nullptr)), world_(rtcNewScene(device_)) {
    const Mesh& mesh = scene.mesh;
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                             mesh.position.size());
    std::memcpy(vertices, mesh.position.data(), mesh.position.size() * sizeof(Vec3f));
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle),
                                              mesh.triangles.size());
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(world_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(world_);
  }
  ~BareEmbree() {
    rtcReleaseScene(world_);
    rtcReleaseDevice(device_);
  }
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  // Sends a point's packets; only the calls are timed.
  double occluded(std::vector<RTCRay16>& packets) const {
    alignas(64) int valid[16];
    std::fill_n(valid, 16, -1);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const double start = thread_seconds();
    for (RTCRay16& rays : packets) rtcOccluded16(valid, world_, &context, &rays);
    return thread_seconds() - start;
  }
  double closest(std::vector<RTCRayHit16>& packets) const {
    alignas(64) int valid[16];
    std::fill_n(valid, 16, -1);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const double start = thread_seconds();
    for (RTCRayHit16& rays : packets) rtcIntersect16(valid, world_, &context, &rays);
    return thread_seconds() - start;
  }

 private:
  RTCDevice device_;
  RTCScene world_;
};

void fill(const Rays16& from, RTCRay16& to) {
  std::memset(&to, 0, sizeof to);
  std::memcpy(to.org_x, from.ox.data(), 64), std::memcpy(to.org_y, from.oy.data(), 64);
  std::memcpy(to.org_z, from.oz.data(), 64), std::memcpy(to.dir_x, from.dx.data(), 64);
  std::memcpy(to.dir_y, from.dy.data(), 64), std::memcpy(to.dir_z, from.dz.data(), 64);
  std::memcpy(to.tfar, from.far.data(), 64);
  std::fill_n(to.mask, 16, ~0U);
}

// The very rays that transfer sends from a point.
void make_packets(const DirectionSets& sets, const TransferPoint& point, std::uint64_t seed, std::uint64_t key,
                  const std::function<void(int, const Rays16&)>& take) {
  const LocalFrame frame = local_frame(sets, point.normal, seed, key);
  Rays16 rays;
  const Vec3f o = ray_origin(point);
  rays.ox.fill(o.x), rays.oy.fill(o.y), rays.oz.fill(o.z), rays.far.fill(kFar);
  for (int p = 0; p < sets.samples() / kPacket; ++p) {
    sets.turn(frame.set, p, frame.basis, rays);
    take(p, rays);
  }
}

struct Points {
  std::vector<std::uint32_t> vertex;  // whole blocks along the Morton curve, spread over the scene
  std::vector<TransferPoint> point;
};

Points choose_points(const Mesh& mesh, std::size_t wanted) {
  const std::vector<TransferPoint> all = vertex_points(mesh);
  const std::vector<std::uint32_t> order = morton_order(mesh.position);
  const std::size_t blocks = (order.size() + kBlock - 1) / kBlock;
  const std::size_t step = std::max<std::size_t>(1, blocks * kBlock / std::max<std::size_t>(wanted, 1));
  Points chosen;
  for (std::size_t b = 0; b < blocks; b += step) {
    for (std::size_t i = b * kBlock; i < std::min(order.size(), (b + 1) * kBlock); ++i) {
      chosen.vertex.push_back(order[i]);
      chosen.point.push_back(all[order[i]]);
    }
  }
  return chosen;
}

struct Rates {
  std::vector<double> ours, bare, wall;  // rays per processor second; ours by the wall clock
};

void print(const std::string& kind, const std::string& scene, const Scene& s, int threads, const Rates& r,
           const std::string& more = "") {
  std::vector<double> share;
  for (std::size_t i = 0; i < r.ours.size(); ++i) share.push_back(r.ours[i] / r.bare[i]);
  std::printf(
      "{\"bench\":\"%s\",\"scene\":\"%s\",\"triangles\":%zu,\"vertices\":%zu,\"threads\":%d,"
      "\"mrays_per_cpu_second\":%.2f,\"bare_embree\":%.2f,\"fraction\":%.3f,\"mrays_per_wall_second\":%.2f%s}\n",
      kind.c_str(), scene.c_str(), s.mesh.triangles.size(), s.mesh.position.size(), threads, median(r.ours) * 1e-6,
      median(r.bare) * 1e-6, median(share), median(r.wall) * 1e-6, more.c_str());
  std::fflush(stdout);
}

void bench_transfer(const std::string& name, const Scene& scene, const Points& points, int rounds, Threads& threads) {
  const DirectTransfer params{.order = 6, .samples = 1024, .seed = 1};
  const Tracer tracer(scene, threads);
  const DirectTransferBaker baker(tracer, params);
  const BareEmbree bare(scene);
  const DirectionSets sets = transfer_directions(params);
  Rates rates;
  for (int round = 0; round < rounds; ++round) {
    TransferStats stats;
    const double wall = wall_seconds(), start = process_seconds();
    baker.bake(points.point, threads, &stats);
    const double seconds = process_seconds() - start;
    rates.ours.push_back(static_cast<double>(stats.rays) / seconds);
    rates.wall.push_back(static_cast<double>(stats.rays) / (wall_seconds() - wall));

    std::atomic<double> bare_seconds = 0;
    threads.for_blocks(points.point.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<RTCRay16> packets(1024 / kPacket);
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const TransferPoint& p = points.point[i];
        make_packets(sets, p, params.seed, point_key(p),
                     [&](int k, const Rays16& rays) { fill(rays, packets[static_cast<std::size_t>(k)]); });
        sum += bare.occluded(packets);
      }
      bare_seconds += sum;
    });
    rates.bare.push_back(static_cast<double>(points.point.size() * 1024) / bare_seconds);
  }
  print("transfer", name, scene, threads.count(), rates, ",\"order\":6,\"samples\":1024");
}

void bench_bounce(const std::string& name, const Scene& scene, const Points& points, int rounds, Threads& threads) {
  constexpr int kSamples = 256;
  const Tracer tracer(scene, threads);
  const Lamps lamps(tracer);
  const GatherFaces faces(scene);
  const DirectionSets sets(0, kSamples, 8, 1);
  const std::size_t row_bytes = PackedRows::row_bytes(6, 3);
  std::vector<std::byte> memory(scene.mesh.position.size() * 2 * row_bytes);  // two rows side by side, as in a bake
  PackedRows rows(6, 3, memory.data(), 2 * row_bytes);
  const HitAlbedo albedo(scene);
  const std::vector<float> row(108, 0.1F);
  for (std::size_t v = 0; v < scene.mesh.position.size(); ++v) rows.store(v, row.data());
  const std::vector<Vec3f> fixed;
  const GatherSource source{tracer, lamps, faces, albedo, sets, rows, fixed, 6, 3, 0, 1};
  const BareEmbree bare(scene);
  Rates rates;
  for (int round = 0; round < rounds; ++round) {
    const double wall = wall_seconds(), start = process_seconds();
    std::atomic<std::uint64_t> rays = 0;  // those of flipped paths among them
    threads.for_blocks(points.point.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      Gatherer gatherer(source);
      for (std::size_t i = begin; i < end; ++i) gatherer.gather(points.point[i]);
      rays += gatherer.rays();
    });
    const double seconds = process_seconds() - start;
    rates.ours.push_back(static_cast<double>(rays) / seconds);
    rates.wall.push_back(static_cast<double>(rays) / (wall_seconds() - wall));

    std::atomic<double> bare_seconds = 0;
    threads.for_blocks(points.point.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<RTCRayHit16> packets(kSamples / kPacket);
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const TransferPoint& p = points.point[i];
        make_packets(sets, p, 1, point_key(p), [&](int k, const Rays16& rays) {
          RTCRayHit16& packet = packets[static_cast<std::size_t>(k)];
          fill(rays, packet.ray);
          std::fill_n(packet.hit.geomID, 16, RTC_INVALID_GEOMETRY_ID);
        });
        sum += bare.closest(packets);
      }
      bare_seconds += sum;
    });
    rates.bare.push_back(static_cast<double>(points.point.size() * kSamples) / bare_seconds);
  }
  print("bounce", name, scene, threads.count(), rates, ",\"order\":6,\"channels\":3,\"samples\":256");
}

// Peak memory of a bake beyond the scene and its tracer: direct transfer, then one bounce in RGB, at few samples.
void bench_memory(const std::string& name, const Scene& scene, Threads& threads) {
  const Tracer tracer(scene, threads);
  const std::size_t vertices = scene.mesh.position.size(), before = held_bytes;
  peak_bytes = before;
  std::vector<float> direct = bake_direct_transfer(tracer, vertex_points(scene.mesh), {.samples = 16}, threads);
  const std::size_t direct_peak = peak_bytes - before;
  peak_bytes = held_bytes.load();
  std::vector<Vec3f> fixed(vertices, Vec3f{1, 1, 1});
  const Transfer t = bake_interreflection(tracer, scene.mesh, std::move(direct), std::move(fixed),
                                          {.bounces = 2, .samples = 16}, threads);
  const std::size_t bounce_peak = peak_bytes - before;
  std::printf(
      "{\"bench\":\"memory\",\"scene\":\"%s\",\"vertices\":%zu,\"order\":6,\"channels\":%d,\"fixed\":true,"
      "\"direct_bytes_per_vertex\":%zu,\"interreflection_bytes_per_vertex\":%zu,\"result_bytes_per_vertex\":%zu}\n",
      name.c_str(), vertices, t.channels, direct_peak / vertices, bounce_peak / vertices, t.stride() * sizeof(float));
}

// Peak memory of adaptive subdivision as a bake does it, to twice the triangles, beside the input and its tracer; the
// final mesh is in it, and given apart.
void bench_subdivision_memory(const std::string& name, const Scene& scene, Threads& threads) {
  constexpr std::size_t kBands = 36;
  const Tracer tracer(scene, threads);
  const DirectTransferBaker baker(tracer, {.samples = 16});
  const ValueSource source{.width = kBands,
                           .values = [&](std::span<const TransferPoint> p) { return baker.bake(p, threads); },
                           .bounded = {0},
                           .hidden = hidden_test(tracer)};
  const std::size_t before = held_bytes;
  peak_bytes = before;
  const Subdivided fine = subdivide(scene.mesh, source, {.triangles = 2 * scene.mesh.triangles.size()}, threads);
  const Mesh& m = fine.mesh;
  const std::size_t mesh = m.position.size() * sizeof(Vec3f) * 2 + m.uv0.size() * sizeof(Vec2f) +
                           m.uv1.size() * sizeof(Vec2f) + (m.color.size() + m.tangent.size()) * sizeof(Vec4f) +
                           m.triangles.size() * (sizeof(Triangle) + sizeof m.part[0] + 1);
  std::printf(
      "{\"bench\":\"subdivision_memory\",\"scene\":\"%s\",\"vertices\":%zu,\"triangles\":%zu,\"order\":6,"
      "\"bytes_per_vertex\":%zu,\"mesh_bytes_per_vertex\":%zu}\n",
      name.c_str(), m.position.size(), m.triangles.size(), (peak_bytes - before) / m.position.size(),
      mesh / m.position.size());
  std::fflush(stdout);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  const std::size_t points = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 4096;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 5;
  const std::string only = argc > 3 ? argv[3] : "";
  Threads threads(2);
  const std::pair<const char*, const char*> scenes[] = {{"bunny", "references/bunny.glb"},
                                                        {"cornell", "references/cornell.glb"},
                                                        {"dungeon", "scenes/dungeon-interior/level-dungeon.gltf"}};
  for (const auto& [name, path] : scenes) {
    if (!only.empty() && only != name) continue;
    const std::optional<Scene> scene = testing::load_scene(KILN_SHARED, path);
    if (!scene) {
      std::fprintf(stderr, "%s is not there\n", path);
      continue;
    }
    const bench::Points chosen = bench::choose_points(scene->mesh, points);
    bench::bench_transfer(name, *scene, chosen, rounds, threads);
    bench::bench_bounce(name, *scene, chosen, rounds, threads);
    bench::bench_memory(name, *scene, threads);
    bench::bench_subdivision_memory(name, *scene, threads);
  }
}
