#include "core/bake/bounce_tail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/trace/reference.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::array<int, 11> kSteps = {0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32};
constexpr std::size_t kPoints = 96;
constexpr int kSamples = 64;
constexpr std::uint64_t kSeed = 0x626f756e6365;
constexpr double kDark = 0.01;  // of an open point's light

std::vector<SurfacePoint> probe_points(const Scene& scene) {
  std::vector<SurfacePoint> points;
  for (const SurfaceSample& s : sample_surface(scene.mesh, kPoints, kSeed))
    points.push_back(surface_point(scene, s.triangle, s.u, s.v));
  return points;
}

double white_share(const Scene& scene, const std::vector<SurfacePoint>& points) {
  const auto white = std::ranges::count_if(points, [&](const SurfacePoint& p) {
    const Vec3f albedo = albedo_at(scene, p);
    return std::min({albedo.x, albedo.y, albedo.z}) > kWhite;
  });
  return static_cast<double>(white) / static_cast<double>(points.size());
}

/// Mean light of each lighting when paths may reflect `bounces` times. The same seed walks the same paths, so the
/// differences between two counts carry little noise.
std::vector<double> mean_light(const Tracer& tracer, const std::vector<ReferencePoint>& points, bool lamps, int bounces,
                               Threads& threads) {
  ReferenceLight light;
  light.sh_order = 1;
  light.sh = {{Vec3f{1, 1, 1} * 3.5449077F}};  // radiance 1 everywhere: 1 / Y(0,0)
  light.scene_lights = lamps;
  const ReferenceResult result =
      trace_reference(tracer, points, light, {.samples = kSamples, .bounces = bounces, .seed = kSeed}, threads);
  std::vector<double> means(result.value.size() / points.size());
  for (std::size_t i = 0; i < result.value.size(); ++i) {
    const Vec3d& v = result.value[i];
    means[i / points.size()] += (v.x + v.y + v.z) / (3 * static_cast<double>(points.size()));
  }
  return means;
}

double left_out(const std::vector<double>& some, const std::vector<double>& all) {
  double worst = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const bool distant = k == 0;
    if (all[k] <= (distant ? kDark : 0.0)) continue;
    worst = std::max(worst, (all[k] - some[k]) / all[k]);
  }
  return worst;
}

}  // namespace

BounceTail measure_bounces(const Tracer& tracer, bool lamps, double tail, Threads& threads) {
  const std::vector<SurfacePoint> probes = probe_points(tracer.scene());
  if (probes.empty()) return {};
  const double white = white_share(tracer.scene(), probes);
  std::vector<ReferencePoint> points;
  for (const SurfacePoint& p : probes) points.push_back({p.position, p.normal, p.geometric_normal});
  const std::vector<double> all = mean_light(tracer, points, lamps, kSteps.back(), threads);
  for (const int bounces : kSteps) {
    const double left = left_out(mean_light(tracer, points, lamps, bounces, threads), all);
    if (left <= tail) return {bounces, left, white};
  }
  return {kSteps.back(), 0, white};
}

}  // namespace kiln
