// Which basis functions cover a place: SphereTree beside Embree's point queries over the same balls, at the same
// places, turn by turn, one thread, medians of processor time. One JSON line.
//   kiln_point_queries [model below the shared ones] [places] [rounds]

#include <embree3/rtcore.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "core/meshless/basis.h"
#include "core/meshless/points.h"
#include "core/prt/gather_faces.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/reference_set.h"

namespace kiln::bench {
namespace {

/// Of one look-up: balls that hold the place, and the sum of what a basis would ask of each, so that nothing is
/// skipped.
struct Found {
  std::uint64_t balls = 0;
  double distances = 0;
  bool operator==(const Found&) const = default;
};

/// The balls as user geometry; a query of radius 0 visits those whose boxes hold the place.
class EmbreeBalls {
 public:
  explicit EmbreeBalls(const std::vector<Ball>& balls)
      : balls_(balls), device_(rtcNewDevice(nullptr)), world_(rtcNewScene(device_)) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(balls.size()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, bound, nullptr);
    rtcSetGeometryPointQueryFunction(geometry, visit);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(world_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(world_);
  }
  ~EmbreeBalls() {
    rtcReleaseScene(world_);
    rtcReleaseDevice(device_);
  }
  EmbreeBalls(const EmbreeBalls&) = delete;
  EmbreeBalls& operator=(const EmbreeBalls&) = delete;

  Found containing(const Vec3f& p) const {
    Asked asked{balls_, {}};
    RTCPointQuery query{p.x, p.y, p.z, 0, 0};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(world_, &query, &context, nullptr, &asked);
    return asked.found;
  }

 private:
  struct Asked {
    const std::vector<Ball>& balls;
    Found found;
  };
  static void bound(const RTCBoundsFunctionArguments* a) {
    const Ball& ball = static_cast<const EmbreeBalls*>(a->geometryUserPtr)->balls_[a->primID];
    const auto& [c, r] = ball;
    *a->bounds_o = {c.x - r, c.y - r, c.z - r, 0, c.x + r, c.y + r, c.z + r, 0};
  }
  static bool visit(RTCPointQueryFunctionArguments* a) {
    Asked& asked = *static_cast<Asked*>(a->userPtr);
    const Ball& ball = asked.balls[a->primID];
    const Vec3f d = ball.center - Vec3f{a->query->x, a->query->y, a->query->z};
    if (const float d2 = dot(d, d); d2 < ball.radius * ball.radius)
      ++asked.found.balls, asked.found.distances += double{d2};
    return false;  // the query's radius stays
  }

  const std::vector<Ball>& balls_;
  RTCDevice device_;
  RTCScene world_;
};

int run(const char* model, std::size_t count, int rounds) {
  const auto scene = testing::load_scene(KILN_SHARED, model);
  if (!scene) return 1;
  Threads threads(1);
  const Tracer tracer(*scene, threads);
  const GatherFaces faces(*scene);
  const PointHierarchy points = place_points(tracer, faces, resolve({}, *scene), threads);
  std::vector<SurfaceSite> sites;
  for (const MeshlessPoint& p : points.points) sites.push_back(p.site);
  const std::vector<std::uint32_t> one_level{static_cast<std::uint32_t>(sites.size())};
  const MeshlessBasis basis(sites, one_level, threads);
  std::vector<Ball> balls;
  for (std::uint32_t i = 0; i < sites.size(); ++i) balls.push_back({sites[i].position, basis.radius(i)});
  std::vector<Vec3f> places;
  for (const SurfaceSample& s : sample_surface(scene->mesh, count, 1))
    places.push_back(surface_point(*scene, s.triangle, s.u, s.v).position);

  const SphereTree ours(balls);
  const EmbreeBalls theirs(balls);
  std::vector<double> our_seconds, their_seconds;
  std::uint64_t our_balls = 0, their_balls = 0;
  double our_sum = 0, their_sum = 0;
  for (int round = 0; round < rounds; ++round) {
    our_balls = their_balls = 0, our_sum = their_sum = 0;
    double start = thread_seconds();
    for (const Vec3f& p : places) {
      ours.containing(p, [&](std::uint32_t, float d2) { ++our_balls, our_sum += double{d2}; });
    }
    our_seconds.push_back(thread_seconds() - start);
    start = thread_seconds();
    for (const Vec3f& p : places) {
      const Found found = theirs.containing(p);
      their_balls += found.balls, their_sum += found.distances;
    }
    their_seconds.push_back(thread_seconds() - start);
  }
  const auto each = [&](std::vector<double> seconds) {
    return 1e9 * median(std::move(seconds)) / double(places.size());
  };
  std::printf(
      "{\"bench\":\"point queries\",\"balls\":%zu,\"places\":%zu,\"found_each\":%.2f,\"same\":%s,\"ours_ns\":%.0f,"
      "\"embree_ns\":%.0f}\n",
      balls.size(), places.size(), double(our_balls) / double(places.size()),
      our_balls == their_balls && std::abs(our_sum - their_sum) <= 1e-9 * our_sum ? "true" : "false", each(our_seconds),
      each(their_seconds));
  return our_balls == their_balls ? 0 : 1;
}

}  // namespace
}  // namespace kiln::bench

int main(int count, char** words) {
  return kiln::bench::run(count > 1 ? words[1] : "scenes/dungeon-interior/level-dungeon.gltf",
                          count > 2 ? std::strtoull(words[2], nullptr, 10) : 200000,
                          count > 3 ? std::max(1, std::atoi(words[3])) : 5);
}
