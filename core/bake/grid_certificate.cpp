#include "core/bake/grid_certificate.h"

#include <chrono>
#include <cmath>
#include <numbers>

#include "core/bake/spending.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/hidden.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::size_t kNoiseVertices = 256;
constexpr double kInterpolated = 8.0 / 27;  // of a vertex's variance is left on average: (integral f^2 + (1-f)^2)^3

/// Random points of the surface that can be seen.
std::vector<ReferencePoint> visible_points(const Tracer& tracer, std::size_t count, std::uint64_t seed) {
  const Mesh& mesh = tracer.scene().mesh;
  const HiddenTest hidden = hidden_test(tracer);
  std::vector<ReferencePoint> out;
  for (const SurfaceSample& s : sample_surface(mesh, count, mix64(seed ^ 0x67636572746966ULL))) {
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const Vec3f position = to_float(match_position(mesh, here)), normal = to_float(match_normal(mesh, here));
    Vec3f face = normalized(area_vector(mesh, mesh.triangles[s.triangle]), normal);
    if (dot(face, normal) < 0) face = -face;
    if (!hidden({position, normal, position, face})) out.push_back({position, normal, face});
  }
  return out;
}

std::vector<Vec3d> values_at(const Grid& grid, const Frame& frame, const std::vector<ReferencePoint>& points) {
  std::vector<Vec3d> out;
  for (const ReferencePoint& p : points) {
    const Vec3f e = irradiance_at(grid, frame.to_world(to_double(p.position)), p.normal);
    out.push_back(to_double(e) / std::numbers::pi);
  }
  return out;
}

/// The job's environment and the scene's lamps together.
struct Truth {
  std::vector<Vec3d> value, noise;
  std::uint64_t rays = 0;
};

Truth truth_at(const GridCheck& check, const std::vector<ReferencePoint>& points, int samples, std::uint64_t seed,
               Threads& threads) {
  ReferenceLight light{.scene_lights = true};
  if (check.world.sky != nullptr) light.environments.push_back(*check.world.sky);
  const ReferenceOptions options{.samples = samples,
                                 .bounces = check.bounces,
                                 .from = check.params.content == GridContent::indirect ? 1 : 0,
                                 .seed = seed};
  const ReferenceResult r = trace_reference(check.world.tracer, points, light, options, threads);
  const auto together = [&](const std::vector<Vec3d>& all) {
    std::vector<Vec3d> sum(points.size());
    for (std::size_t i = 0; i < all.size(); ++i) sum[i % points.size()] += all[i];
    return sum;
  };
  if (points.empty()) return {};
  return {together(r.value), noise_from_halves(together(r.half_a), together(r.half_b)), r.rays};
}

double mean_size(const std::vector<Vec3d>& values) {
  double sum = 0;
  for (const Vec3d& x : values) sum += (std::abs(x.x) + std::abs(x.y) + std::abs(x.z)) / 3;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double mean_square(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += dot(a[i] - b[i], a[i] - b[i]) / 3;
  return a.empty() ? 0 : sum / static_cast<double>(a.size());
}

/// Variance of irradiance / pi along the axes at a vertex, from two draws.
double vertex_variance(const GridCheck& check, std::uint64_t seed, Threads& threads) {
  const Lattice& lattice = check.baked.grid.lattice;
  const std::vector<Vec3f> places = gather_places(lattice, check.world.tracer.scene(), threads);
  const std::size_t count = std::min(kNoiseVertices, places.size());
  const SphereGather one(check.world, check.params.content, check.params.rays, mix64(seed)),
      other(check.world, check.params.content, check.params.rays, mix64(seed + 1));
  std::vector<double> squares(count);
  threads.for_blocks(count, 8, [&](std::size_t begin, std::size_t end) {
    std::uint64_t rays = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t v = i * places.size() / count;
      const auto a = one.at(places[v], v, rays), b = other.at(places[v], v, rays);
      for (std::size_t d = 0; d < kDirections; ++d) {
        for (std::size_t c = 0; c < 3; ++c) {
          const double apart = double{a.light.vector[d][c][d / 2]} - double{b.light.vector[d][c][d / 2]};
          squares[i] += apart * apart / (2 * 18 * std::numbers::pi * std::numbers::pi);
        }
      }
    }
  });
  double sum = 0;
  for (const double x : squares) sum += x;
  return sum / static_cast<double>(std::max<std::size_t>(1, count));
}

}  // namespace

GridCertificate certify_grid(const GridCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const Tracer& tracer = check.world.tracer;
  const Frame& frame = tracer.scene().frame;
  const std::uint64_t seed = mix64(check.params.seed ^ 0x677472757468ULL);

  const std::vector<ReferencePoint> few = visible_points(tracer, Spending::kFewestPoints, seed);
  const std::vector<Vec3d> shown = values_at(check.decoded, frame, few);
  const Truth pilot = truth_at(check, few, Spending::kPilotSamples, mix64(seed), threads);
  const ErrorStats known = compute_error({shown, pilot.value, pilot.noise, few.size()}, {.seed = seed, .resamples = 1});
  const double paths = static_cast<double>(std::max<std::size_t>(few.size(), 1)) * Spending::kPilotSamples;
  const Spending spending = plan_spending(known, std::max(1.0, static_cast<double>(pilot.rays) / paths),
                                          check.baked.stats.rays, check.thorough);

  const std::vector<ReferencePoint> points = visible_points(tracer, spending.points, seed);
  const std::vector<Vec3d> values = values_at(check.decoded, frame, points);
  const Truth truth = truth_at(check, points, spending.samples, seed, threads);
  GridCertificate out;
  out.points = points.size();
  out.samples = spending.samples;
  out.rays = pilot.rays + truth.rays;
  out.mean_light = mean_size(truth.value);
  out.dark = !(out.mean_light > 0) && !(mean_size(values) > 0);
  out.error = compute_error({values, truth.value, truth.noise, points.size()}, {.seed = seed});
  if (out.mean_light > 0) {
    Grid written = check.baked.grid;
    written.lattice.origin = frame.to_world(written.lattice.origin);
    written.lattice.spacing = written.lattice.spacing * frame.scale;
    out.sources.storage = std::sqrt(mean_square(values, values_at(written, frame, points))) / out.mean_light;
    out.sources.noise = std::sqrt(kInterpolated * vertex_variance(check, seed, threads)) / out.mean_light;
    const double known_squares = std::pow(out.sources.noise, 2) + std::pow(out.sources.storage, 2);
    out.sources.lattice = std::sqrt(std::max(0.0, std::pow(out.error.relrmse, 2) - known_squares));
  }
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
