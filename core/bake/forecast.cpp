#include "core/bake/forecast.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/bake/direct_source.h"
#include "core/bake/lightings.h"
#include "core/bake/merge_step.h"
#include "core/bake/plan.h"
#include "core/bake/transport.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/glossy_bake.h"
#include "core/prt/interreflection.h"
#include "core/sphere/sh.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::size_t kPoints = 256, kRuns = 8, kLong = 128;
constexpr std::size_t kLarge = 4096;           // vertices
constexpr std::uint64_t kSeed = 0x70696c6f74;  // never the bake's own

std::vector<TransferPoint> pilot_points(const Scene& scene) {
  std::vector<TransferPoint> out;
  for (const SurfaceSample& s : sample_surface(scene.mesh, kPoints, kSeed)) {
    const SurfacePoint p = surface_point(scene, s.triangle, s.u, s.v);
    out.push_back({p.position, p.normal, p.position, p.geometric_normal});
  }
  return out;
}

/// As subdivision asks: neighbours together. Points far from each other would find nothing of a large mesh in the
/// cache.
std::vector<TransferPoint> neighbours(const Mesh& mesh) {
  std::vector<TransferPoint> out;
  for (std::size_t run = 0; run < kRuns; ++run) {
    const std::size_t first = run * (mesh.position.size() - kLong) / kRuns;
    for (std::size_t i = 0; i < kLong; ++i)
      out.push_back(vertex_point(mesh, static_cast<std::uint32_t>(first + i), kNoFace));
  }
  return out;
}

template <class Work>
double seconds_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Counts of the refined mesh, from those of the input.
struct Sizes {
  double triangles, vertices, edges;
};

Sizes sizes_of(const Plan& plan, const Mesh& input) {
  auto t = static_cast<double>(input.triangles.size()), v = static_cast<double>(input.position.size());
  const bool open = plan.costs.sky_rays == 0 && plan.costs.lamp_rays == 0;  // light changes nowhere
  if (plan.merge) {
    const auto kept = static_cast<double>(plan.merge->triangles);
    v *= kept / std::max(t, 1.0);
    t = kept;
  }
  if (!plan.split || open) return {t, v, 0};
  const auto triangles = static_cast<double>(plan.subdivide.triangles);
  const double boundary = std::clamp(2 * v - t, 0.0, 3 * t) * std::sqrt(triangles / std::max(t, 1.0));
  return {triangles, std::max(v, (triangles + boundary) / 2), (3 * triangles + boundary) / 2};
}

/// Where light is asked for while the mesh is split.
struct Asked {
  double exact, rough;
};

Asked asked_of(const Sizes& sizes) {
  if (sizes.edges == 0) return {sizes.vertices, 0};
  return {sizes.vertices + sizes.edges, sizes.triangles};
}

/// Rays of the rough points over those of the exact ones.
double rough_share(const Plan& plan, double exact_rays) {
  const double most = static_cast<double>(plan.samples) / kRoughRays;
  return exact_rays > most ? most / exact_rays : 1;
}

// Of a reflected ray, its hit and what it gathers, against a ray for distant light and its share of projection: 2
// (scans in the open) to 5 (dungeon) were measured.
constexpr double kReflectedPrice = 3.4;
// With lamps the spots that they make are looked for from their end too (bright_spots.h): .56 to .83 of the seconds of
// four scenes with lamps were foretold without it.
constexpr double kSpotPrice = 1.35;
// Vertices of little surface take fewer rays (interreflection.cpp): .74 to .96 of them on four scenes that were split.
constexpr double kSplitShare = 0.8;

double stored_bytes_of_vertex(const Plan& plan, double slots) {
  constexpr double kFixed = 3, kSeesNoSky = 0.005;
  const double lamps = plan.lamps ? kFixed : 0;
  if (plan.costs.sky_light < kSeesNoSky) return lamps;
  if (plan.encoding.form == PrtStep::Encoding::Form::raw) return slots * 3 * plan.raw_bits / 8 * 0.65;
  return 0.62 * slots + lamps;
}

/// A count of what may be beyond counting.
std::uint64_t whole(double x) { return static_cast<std::uint64_t>(std::min(x, 1e18)); }

// Of what points hold, read at a vertex with what it sees of them, in seconds; placing a point and asking around it.
constexpr double kReadPrice = 3e-5, kPointPrice = 1e-4;
// Of the points, those that gather: .8 to .95 on scans, .4 where walls are flat.
constexpr double kGathered = 0.8;

double points_of(const PointPlacement& placement, const Scene& scene) {
  return expected_points(placed_area(placement, scene), std::ldexp(double{placement.radius}, 1 - placement.levels));
}

/// Matrices that so many vertices read.
double matrices_on_points(const Plan& plan, const Scene& scene, double vertices) {
  return kGathered * points_of(matrix_points(*plan.meshless, scene, plan.glossy.parts, vertices), scene);
}

/// Of reflected light: at the vertices, or on points.
struct ReflectionCosts {
  double rays = 0, seconds = 0, memory = 0;
};

ReflectionCosts reflection_costs(const Plan& plan, const Scene& scene, const Sizes& sizes, double price) {
  if (plan.bounces == 0) return {};
  if (!plan.meshless) {
    const Interreflection passes{.bounces = plan.bounces, .samples = plan.bounce_samples};
    const double rays = sizes.vertices * (plan.split ? kSplitShare : 1) * static_cast<double>(rays_per_vertex(passes));
    return {.rays = rays, .seconds = rays * kReflectedPrice * (plan.lamps ? kSpotPrice : 1) * price};
  }
  const double points = points_of(sweep_points(*plan.meshless, scene, sizes.vertices), scene);
  const double numbers = 3 * (sh_count(plan.order) + (plan.lamps ? 1 : 0));
  const double direct = points * plan.costs.sky_rays * rough_share(plan, plan.costs.sky_rays);
  const double gathered = kGathered * points * plan.bounce_samples;
  const double swept = 4e-11 * gathered * numbers * (plan.bounces + 4);  // the last one with its turning
  return {.rays = direct + gathered,
          .seconds = direct * price + gathered * kReflectedPrice * price + swept + kPointPrice * points +
                     kReadPrice * sizes.vertices,
          .memory = 12 * gathered + points * (300 + 4 * numbers * 6)};
}

/// Of the matrices, as if vertices were added everywhere alike: too few where most of the new ones are on metal.
struct MatrixCosts {
  double rays = 0, seconds = 0, memory = 0, bytes = 0;
};

MatrixCosts matrix_costs(const Plan& plan, const Scene& scene, double vertices, double price) {
  if (!plan.glossy) return {};
  constexpr double kComponents = 128, kSamples = 2 * kGlossySamples, kProduct = 1.5e-4;
  constexpr double kAdding = 1.3e-10;  // of a ray, for each number of its matrix: lantern, helmet and mixed lamps
  const double count = vertices * plan.glossy.vertex_share, outputs = sh_count(plan.glossy.order);
  const double numbers = 3 * outputs * (outputs + (plan.lamps ? 1 : 0));
  const double computed = plan.meshless ? matrices_on_points(plan, scene, count) : count;
  const double rays = (computed + kSamples) * plan.glossy.samples;
  return {.rays = rays,
          .seconds = rays * (kReflectedPrice * price + kAdding * numbers) + computed * kProduct + 0.4 +
                     (plan.meshless ? kReadPrice * count : 0),
          .memory = 8 * count * kComponents + 2.5 * 8 * numbers * kGlossySamples,
          .bytes = 95 * count + 4 * (kComponents + 1) * numbers + 5e4};
}

/// Of merging, which looks at the input twice by few rays (merge_step.h). Simplification took 40 to 60 us a vertex.
struct MergeCosts {
  double rays = 0, seconds = 0, memory = 0;
};

MergeCosts merge_costs(const Plan& plan, double vertices, double slots, double more) {
  if (!plan.merge) return {};
  constexpr double kSimplify = 5e-5, kSimplifyMemory = 700;
  const PointCosts& costs = plan.costs;
  const double share = rough_share(plan, costs.sky_rays * more) * more, lamps = more / kRoughRays;
  const double price = costs.sky_rays > 0 ? costs.sky_seconds / costs.sky_rays : 0;
  const Interreflection few{.bounces = std::min(plan.bounces, kMergeReflections),
                            .samples = std::max(16, plan.bounce_samples / kRoughRays)};
  const double reflected = few.bounces > 0 ? static_cast<double>(rays_per_vertex(few)) : 0;
  return {.rays = 2 * vertices * (costs.sky_rays * share + costs.lamp_rays * lamps + reflected),
          .seconds = vertices * (2 * (costs.sky_seconds * share + costs.lamp_seconds * lamps +
                                      reflected * kReflectedPrice * price) +
                                 kSimplify),
          .memory = vertices * (kSimplifyMemory + 4 * slots * (plan.bounces > 0 ? 12 : 4))};
}

}  // namespace

PointCosts measure_costs(const Tracer& tracer, const Plan& plan, Threads& threads) {
  PointCosts out{.samples = plan.samples};
  const std::vector<TransferPoint> points = pilot_points(tracer.scene());
  if (points.empty()) return out;
  const auto n = static_cast<double>(points.size());
  const TransferRays rays = transfer_rays(tracer, plan, band_power(plan.order, {}), kSeed, threads);
  const DirectTransferBaker sky(tracer, rays.sky);
  TransferStats stats;
  std::vector<float> values;
  out.sky_seconds = seconds_of([&] { values = sky.bake(points, threads, &stats); }) / n;
  out.sky_rays = static_cast<double>(stats.rays) / n;
  if (tracer.scene().mesh.position.size() >= kLarge) {
    const std::vector<TransferPoint> near = neighbours(tracer.scene().mesh);
    sky.bake(near, threads, nullptr);  // once to warm the cache
    stats = {};
    const double seconds = seconds_of([&] { sky.bake(near, threads, &stats); });
    if (stats.rays > 0) out.sky_seconds = out.sky_rays * seconds / static_cast<double>(stats.rays);
  }
  for (std::size_t p = 0; p < points.size(); ++p)
    out.sky_light += 2 * std::sqrt(M_PI) * values[p * static_cast<std::size_t>(sh_count(plan.order))] / n;
  if (!plan.lamps) return out;
  stats = {};
  out.lamp_seconds = seconds_of([&] { bake_fixed_direct(tracer, points, rays.lamps, threads, &stats); }) / n;
  out.lamp_rays = static_cast<double>(stats.rays) / n;
  return out;
}

Prediction predict(const Plan& plan, const Scene& scene) {
  const Sizes sizes = sizes_of(plan, scene.mesh);
  const Asked asked = asked_of(sizes);
  const double slots = sh_count(plan.order) + (plan.lamps ? 1 : 0);
  const PointCosts& costs = plan.costs;
  const double more = static_cast<double>(plan.samples) / costs.samples;  // a later pass than the one that was measured
  const double sky = asked.exact + asked.rough * rough_share(plan, costs.sky_rays * more);
  const double lamp = asked.exact + asked.rough / kRoughRays;
  const double sky_rays = sky * costs.sky_rays * more, lamp_rays = lamp * costs.lamp_rays * more;
  const double price = costs.sky_rays > 0 ? costs.sky_seconds / costs.sky_rays : 0;
  const ReflectionCosts reflected = reflection_costs(plan, scene, sizes, price);
  const double traced = (sky * costs.sky_seconds + lamp * costs.lamp_seconds) * more + reflected.seconds;
  const double splitting = plan.split ? 1.4e-5 * sizes.triangles : 0;
  const double writing = sizes.vertices * (5e-6 + 4.5e-7 * slots);
  const double certificate = 0.12 + 0.04 * traced;

  const MatrixCosts matrices = matrix_costs(plan, scene, sizes.vertices, price);
  const MergeCosts merging = merge_costs(plan, static_cast<double>(scene.mesh.position.size()), slots, more);
  double pixels = 0, files = 0;
  for (const Image& image : scene.images) {
    pixels += static_cast<double>(image.rgba.size());
    files += static_cast<double>(image.encoded.size());
  }
  const double input_vertices = static_cast<double>(scene.mesh.position.size());
  Prediction out;
  out.triangles = static_cast<std::uint64_t>(sizes.triangles);
  out.vertices = static_cast<std::uint64_t>(sizes.vertices);
  out.rays = whole(sky_rays + lamp_rays + reflected.rays + matrices.rays + merging.rays);
  out.seconds = 0.05 + traced + splitting + writing + certificate + matrices.seconds + merging.seconds;
  const double baking = sizes.vertices * (620 + 40 * slots) + matrices.memory + reflected.memory;
  out.memory_bytes = whole(24e6 + std::max(baking, merging.memory) + 2 * pixels + 2 * files);
  out.artifact_bytes = static_cast<std::uint64_t>(
      2000 + 2500 * static_cast<double>(scene.parts.size()) + files + 4.5 * (sizes.vertices + input_vertices) +
      sizes.vertices * stored_bytes_of_vertex(plan, slots) + matrices.bytes);
  return out;
}

}  // namespace kiln
