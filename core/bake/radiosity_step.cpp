#include "core/bake/radiosity_step.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/bake/bounce_tail.h"
#include "core/bake/direct_source.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/direct_light.h"
#include "core/meshless/paper_bounces.h"
#include "core/prt/ray_origin.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

double mean_of(const std::vector<Vec3f>& values) {
  double sum = 0;
  for (const Vec3f& x : values) sum += double{x.x} + double{x.y} + double{x.z};
  return values.empty() ? 0 : sum / (3 * static_cast<double>(values.size()));
}

bool has_lamps(const Scene& scene) {
  if (!scene.lights.empty()) return true;
  return std::any_of(scene.parts.begin(), scene.parts.end(), [&](const Part& part) {
    return length(scene.materials[static_cast<std::size_t>(part.material)].emission) > 0;
  });
}

/// Seconds and rays of direct light at one point (lamp_seconds, lamp_rays), by a pilot over the surface.
PointCosts pilot_direct(const Tracer& tracer, const Plan& plan, const Environment* sky, Threads& threads) {
  const DirectLight light(tracer, sky, plan.radiosity->direct);
  std::vector<TransferPoint> points;
  for (const SurfaceSample& s : sample_surface(tracer.scene().mesh, 256, 0x70696c6f74)) {
    const SurfacePoint p = surface_point(tracer.scene(), s.triangle, s.u, s.v);
    points.push_back({p.position, p.normal, p.position, p.geometric_normal});
  }
  if (points.empty()) return {};
  std::uint64_t rays = 0;
  const auto start = std::chrono::steady_clock::now();
  light_at(points, light, 1, rays, threads);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto n = static_cast<double>(points.size());
  return {.lamp_rays = static_cast<double>(rays) / n, .lamp_seconds = seconds / n};
}

/// A count of what may be beyond counting.
std::uint64_t whole(double x) { return static_cast<std::uint64_t>(std::min(x, 1e18)); }

/// Vertices that gather twice to tell where errors come from: a twentieth of the work at most, 64 at least.
std::size_t probes_for(double points) {
  return static_cast<std::size_t>(std::clamp(points / 40, 64.0, double{kNoiseProbes}));
}

/// Direct light in two independent draws: the second minus the first.
Probes draw_twice(const Mesh& mesh, const std::vector<std::uint32_t>& vertices, const DirectLight& light,
                  std::uint64_t seed, std::uint64_t& rays, Threads& threads) {
  const std::vector<TransferPoint> at = points_at(mesh, vertices);
  const std::vector<Vec3f> first = light_at(at, light, mix64(seed ^ 0x647261776131ULL), rays, threads),
                           second = light_at(at, light, mix64(seed ^ 0x647261776132ULL), rays, threads);
  Probes out{.vertices = vertices, .difference = {}};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Vec3f d = second[i] - first[i];
    out.difference.insert(out.difference.end(), {d.x, d.y, d.z});
  }
  return out;
}

/// Of what vertices read, r, and two gathers of their own, a and b: the noise of r is that of a gather times its
/// spread, and (a - r)(b - r) has it in the mean too, with the square of what reading from elsewhere is off by.
void weigh(const std::vector<GatherProbe>& probes, const std::vector<std::uint32_t>& vertices, SolvedRadiosity& out) {
  double sum = 0;
  out.noise.reflected.vertices = vertices;
  for (const GatherProbe& p : probes) {
    const Vec3f d = (p.second - p.first) * std::sqrt(p.spread);
    out.noise.reflected.difference.insert(out.noise.reflected.difference.end(), {d.x, d.y, d.z});
    sum += double{dot(p.first - p.read, p.second - p.read)} - 0.5 * double{dot(d, d)};
  }
  if (probes.empty()) out.noise.reflected.vertices.clear();
  out.points_squared = probes.empty() ? 0 : std::max(0.0, sum / (3 * static_cast<double>(probes.size())));
}

double points_of(const Plan& plan, const Scene& scene) {
  const PointPlacement& p = plan.radiosity->points;
  return expected_points(surface_area(scene.mesh), std::ldexp(double{p.radius}, 1 - p.levels));
}

std::string points_text(const Plan& plan, const Scene& scene) {
  return "about " + short_text(points_of(plan, scene)) + " on " + std::to_string(plan.radiosity->points.levels) +
         " levels";
}

void predict_radiosity(Plan& plan, const Scene& scene) {
  const PointCosts& pilot = plan.costs;
  const double points = points_of(plan, scene);
  constexpr double kReflectedPrice = 3.4;  // of a gathering ray, as in forecast.cpp
  const double input = static_cast<double>(scene.mesh.position.size());
  const double triangles = static_cast<double>(plan.split ? plan.subdivide.triangles : scene.mesh.triangles.size());
  const double vertices = plan.split ? std::max(input, 0.55 * triangles) : input;
  const double asked = plan.split ? vertices + 1.5 * triangles + triangles / kRoughRays : vertices;
  const double direct = asked * pilot.lamp_rays + points * pilot.lamp_rays / 4;
  const double gathered = points * plan.radiosity->rays;
  const double price = pilot.lamp_rays > 0 ? pilot.lamp_seconds / pilot.lamp_rays : 0;
  double pixels = 0, files = 0;
  for (const Image& image : scene.images) {
    pixels += static_cast<double>(image.rgba.size());
    files += static_cast<double>(image.encoded.size());
  }
  Prediction& out = plan.prediction;
  out.triangles = static_cast<std::uint64_t>(triangles);
  out.vertices = static_cast<std::uint64_t>(vertices);
  out.rays = whole(direct + gathered);
  out.seconds = 0.2 + price * (direct + kReflectedPrice * gathered) + 1.4e-5 * triangles + 6e-6 * vertices;
  out.memory_bytes =
      whole(24e6 + 700 * vertices + points * (300 + 12.0 * plan.radiosity->rays) + 2 * pixels + 2 * files);
  out.artifact_bytes = static_cast<std::uint64_t>(2000 + 2500.0 * static_cast<double>(scene.parts.size()) + files +
                                                  4.5 * (vertices + input) + 5 * vertices);
}

}  // namespace

/// The error that each is for was measured with core/meshless on the shared references.
RadiosityEffort radiosity_effort(Quality quality) {
  switch (quality) {
    case Quality::draft:
      return {"the draft quality", 10'000, 2e-4F, {{16, 64}, 64}, 128, 0.05F, 0.25};
    case Quality::standard:
      return {"the standard quality", 40'000, 5e-5F, {{32, 128}, 256}, 512, 0.02F, 1};
    case Quality::finest:
      break;
  }
  return {"the final quality", 160'000, 1e-5F, {{64, 512}, 1024}, 1024, 0.01F, 4};
}

RadiosityEffort radiosity_effort(const Promise& promise) {
  const double target = promise.target_error.value_or(0.05);
  const int rays = std::clamp(16 * static_cast<int>(std::lround(0.4 / target)), 64, 256);
  const auto triangles = static_cast<std::uint64_t>(std::clamp(100 / target, 500.0, 10'000.0));
  const double storage = std::clamp(promise.target_error.value_or(0) / 10, 1e-3, 5e-3);
  return {"the first pass", triangles, 0, {{rays / 4, rays}, rays}, rays, 0.05F, 0.25, storage};
}

Plan make_radiosity_plan(const Scene& scene, const RadiosityStep& step, const RadiosityEffort& effort,
                         const Environment* sky, Threads& threads) {
  Plan plan;
  plan.order = 0;
  plan.raw_bits = 16;
  plan.compression = effort.storage;
  plan.encoding.form = PrtStep::Encoding::Form::raw;
  plan.lamps = has_lamps(scene);
  plan.radiosity.emplace();
  Radiosity& r = *plan.radiosity;
  r.direct = effort.direct;
  r.rays = step.rays.value_or(effort.rays);
  r.eps = static_cast<float>(step.eps_irradiance.value_or(effort.eps));
  r.bounces = step.bounces.value_or(-1);
  r.points.levels = step.levels.value_or(0);
  if (step.radius) r.points.radius = static_cast<float>(std::max(*step.radius / scene.frame.scale, 1e-30));
  r.points.wanted = resolve({}, scene).wanted;
  r.points.wanted = static_cast<std::uint64_t>(effort.points * static_cast<double>(r.points.wanted));
  r.points = resolve(r.points, scene);
  const double finest = std::ldexp(double{r.points.radius}, 1 - r.points.levels);

  const std::string asked = "asked for by the recipe";
  decide(plan, "light", sky == nullptr ? "lamps" : sky->name,
         plan.lamps ? "the scene has emitters or punctual lights of its own" : "the scene has no light of its own");
  if (step.scheme == RadiosityStep::Scheme::paper) {
    r.paper = static_cast<float>(step.eps_solid_angle.value_or(kPaperSolidAngle));
    decide(plan, "scheme", "paper", "asked for by the recipe: each bounce evaluates the basis where rays land");
  } else {
    decide(plan, "scheme", "rows", "the transport operator is traced once; bounces are sparse sweeps");
  }
  decide(plan, "points", points_text(plan, scene),
         step.radius
             ? asked
             : effort.reason + std::string(" takes radii from ") + short_text(r.points.radius * scene.frame.scale) +
                   " to " + short_text(finest * scene.frame.scale) + " m for this surface and its vertices");
  decide(plan, "rays", std::to_string(r.rays), step.rays ? asked : effort.reason);
  decide(plan, "eps_irradiance", short_text(double{r.eps}), step.eps_irradiance ? asked : effort.reason);
  decide(plan, "bounces", r.bounces < 0 ? "auto" : std::to_string(r.bounces),
         r.bounces < 0 ? "until a ten-thousandth of the light is left" : asked);

  using Mode = PrtStep::Subdivision::Mode;
  const std::uint64_t input = scene.mesh.triangles.size();
  const std::uint64_t budget = step.subdivide.triangles.value_or(input + effort.triangles);
  plan.split = step.deliver.vertices && step.subdivide.mode != Mode::off && budget > input;
  plan.triangles_of_quality = effort.triangles;
  plan.subdivide = {.measure = step.subdivide.measure,
                    .alpha = step.subdivide.alpha,
                    .threshold = step.subdivide.threshold.value_or(effort.threshold),
                    .triangles = budget,
                    .max_depth = step.subdivide.max_depth};
  decide(plan, "subdivide", plan.split ? "up to " + std::to_string(budget) + " triangles" : "no",
         !step.deliver.vertices             ? "the light of the vertices is not delivered"
         : step.subdivide.mode == Mode::off ? "turned off by the recipe"
         : step.subdivide.triangles         ? asked
                                    : effort.reason + std::string(" adds triangles where direct light changes"));
  const Tracer tracer(scene, threads);
  plan.costs = pilot_direct(tracer, plan, sky, threads);
  predict_radiosity(plan, scene);
  return plan;
}

void grow_radiosity(Plan& plan, const RadiosityGrowth& growth, const Scene& scene) {
  static constexpr double kMostRays = 65536;
  const auto more = [](int rays, double times) {
    return static_cast<int>(std::min(kMostRays, std::ceil(rays * times / 16) * 16));
  };
  Radiosity& r = *plan.radiosity;
  r.rays = more(r.rays, growth.reflected);
  if (growth.direct > 1) {
    LampRays& lamps = r.direct.lamps;
    lamps = {more(lamps.few, growth.direct), more(lamps.many, growth.direct)};
    plan.costs.lamp_seconds *= growth.direct, plan.costs.lamp_rays *= growth.direct;
    r.direct.sky = more(r.direct.sky, growth.direct);
  }
  // Points lie as the root of the area of each apart, and what they predict is off by about as much.
  const auto nearer = static_cast<float>(1 / std::sqrt(growth.points));
  r.points.radius *= nearer;
  if (!growth.eps_fixed) r.eps *= nearer;
  predict_radiosity(plan, scene);
  for (Decision& d : plan.decisions) {
    if (d.decision == "rays" && growth.reflected > 1) d = {d.decision, std::to_string(r.rays), growth.reason};
    if (growth.points == 1) continue;
    if (d.decision == "points") d = {d.decision, points_text(plan, scene), growth.reason};
    if (d.decision == "eps_irradiance" && !growth.eps_fixed) d = {d.decision, short_text(double{r.eps}), growth.reason};
  }
}

SolvedRadiosity solve_radiosity_step(Scene& scene, Plan& plan, const Environment* sky, const RadiosityHooks& hooks,
                                     BakeLog& log, Threads& threads) {
  Radiosity params = *plan.radiosity;
  SolvedRadiosity out;
  log.begin("direct", plan.grid ? 0.3 : 0.55);
  {
    const Tracer tracer(scene, threads);
    const DirectLight light(tracer, sky, params.direct), rough(tracer, sky, params.direct.rough());
    std::uint64_t rays = 0, points = 0;
    const std::uint64_t expected =
        std::max<std::uint64_t>(1, plan.split ? 3 * plan.subdivide.triangles : scene.mesh.position.size());
    const double mean = mean_of(light_at(spread_points(scene.mesh), rough, params.seed, rays, threads));
    const float scale = mean > 1e-30 && mean < 1e30 ? static_cast<float>(kOpenConstantBand / mean) : 1.0F;
    const auto columns = [&](std::span<const TransferPoint> batch, const DirectLight& from) {
      std::vector<float> out;
      const std::vector<float> more = hooks.more.width > 0 ? hooks.more.values(batch) : std::vector<float>{};
      const std::vector<Vec3f> light_there = light_at(batch, from, params.seed, rays, threads);
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const Vec3f& x = light_there[i];
        out.insert(out.end(), {x.x * scale, x.y * scale, x.z * scale});
        for (std::size_t k = 0; k < hooks.more.width; ++k)
          out.push_back(kOpenConstantBand * more[i * hooks.more.width + k]);
      }
      points += batch.size();
      log.advance(std::min(points, expected), expected);
      return out;
    };
    const std::size_t width = 3 + hooks.more.width;
    const ValueSource source{.width = width,
                             .values = [&](std::span<const TransferPoint> batch) { return columns(batch, light); },
                             .bounded = {0, 1, 2},
                             .hidden = hidden_test(tracer),
                             .rough = [&](std::span<const TransferPoint> batch) { return columns(batch, rough); }};
    const Mesh base = plan.split ? base_mesh(tracer, plan, source, params.bounces != 0, threads) : scene.mesh;
    Subdivide split = plan.subdivide;
    if (!plan.split) split = {.triangles = 0};
    Subdivided fine = subdivide(base, source, split, threads);
    params.stand_ins = std::move(fine.stand_ins);
    params.known_direct.resize(fine.mesh.position.size());
    for (std::size_t v = 0; v < params.known_direct.size(); ++v) {
      const float* x = &fine.values[width * v];
      params.known_direct[v] = Vec3f{std::max(0.0F, x[0]), std::max(0.0F, x[1]), std::max(0.0F, x[2])} / scale;
    }
    scene.mesh = std::move(fine.mesh);
    if (hooks.sources) {
      params.probes = choose_probes(scene.mesh, probes_for(points_of(plan, scene)));
      out.noise.direct = draw_twice(scene.mesh, params.probes, light, params.seed, rays, threads);
    }
    log.count_rays(rays);
  }

  log.begin("bounces", plan.grid ? 0.4 : 0.85);
  const Tracer tracer(scene, threads);
  params.places = hooks.places;
  params.light_points = hooks.lit_points != nullptr;
  const RadiosityResult r = solve_radiosity(tracer, sky, params, threads);
  log.count_rays(r.stats.direct_rays + r.stats.gather_rays);
  for (const std::uint32_t n : r.stats.gathered) out.gathered += n;
  for (const std::uint32_t n : r.stats.points) out.points += n;
  decide(plan, "gathered", std::to_string(out.gathered) + " of " + std::to_string(out.points) + " points",
         "what coarser points predict within eps_irradiance is not gathered; " + std::to_string(r.stats.alone) +
             (params.places.empty() ? "" : " texels and") + " vertices gather for themselves; " +
             std::to_string(r.stats.sweeps) + " sweeps");

  const std::size_t vertices = scene.mesh.position.size();
  if (hooks.lit_points) hooks.lit_points(r.points, r.point_light);
  if (hooks.lit_places) {
    const DirectLight light(tracer, sky, params.direct);
    std::uint64_t rays = 0;
    hooks.lit_places(
        {std::span(r.direct).subspan(vertices), std::span(r.indirect).subspan(vertices),
         [&](std::span<const TransferPoint> points) { return light_at(points, light, params.seed, rays, threads); },
         tracer});
    log.count_rays(rays);
  }
  std::vector<Vec3f> light;
  for (std::size_t v = 0; v < vertices; ++v) light.push_back(r.direct[v] + r.indirect[v]);
  if (hooks.lit) hooks.lit(tracer, r.surface.get(), light);

  out.transfer = {.order = 0, .channels = 3, .fixed = true, .coefficients = {}};
  out.transfer.coefficients.reserve(3 * light.size());
  for (const Vec3f& x : light) out.transfer.coefficients.insert(out.transfer.coefficients.end(), {x.x, x.y, x.z});
  out.gather_rays = r.stats.gather_rays;
  if (!hooks.sources) return out;
  if (params.bounces > 0) out.tail = r.stats.tail;
  if (params.bounces == 0) out.tail = measure_bounces(tracer, plan.lamps, 1, threads).left;
  if (params.bounces < 0) out.tail = kTail;
  weigh(r.probes, params.probes, out);
  return out;
}

}  // namespace kiln
