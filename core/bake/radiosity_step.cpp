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

/// All light at places, as subdivision sees it: in parts of its mean, so that it counts like an open sky of 1.
class LightSource {
 public:
  struct Work {
    const Tracer& tracer;
    const Environment* sky;
    const Plan& plan;
    ReflectedLight& reflected;
    const MoreLight& more;
  };
  /// Keeps references.
  LightSource(const Work& work, BakeLog& log, Threads& threads)
      : work_(work),
        log_(log),
        threads_(threads),
        seed_(work.plan.radiosity->seed),
        light_(work.tracer, work.sky, work.plan.radiosity->direct),
        rough_(work.tracer, work.sky, work.plan.radiosity->direct.rough()),
        hidden_(hidden_test(work.tracer)),
        expected_(work.plan.split ? 3 * work.plan.subdivide.triangles : work.tracer.scene().mesh.position.size()) {
    const double mean = mean_of(all_light(spread_points(work.tracer.scene().mesh), rough_));
    if (mean > 1e-30 && mean < 1e30) scale_ = static_cast<float>(kOpenConstantBand / mean);
  }

  ValueSource source() {
    return {.width = width(),
            .values = [this](std::span<const TransferPoint> batch) { return columns(batch, light_); },
            .bounded = {0, 1, 2},
            .hidden = hidden_,
            .rough = [this](std::span<const TransferPoint> batch) { return columns(batch, rough_); }};
  }

  /// Of rows that subdivision has found.
  std::vector<Vec3f> light_of(std::span<const float> rows) const {
    std::vector<Vec3f> out;
    for (std::size_t i = 0; i < rows.size(); i += width())
      out.push_back(Vec3f{std::max(0.0F, rows[i]), std::max(0.0F, rows[i + 1]), std::max(0.0F, rows[i + 2])} / scale_);
    return out;
  }

 private:
  std::size_t width() const { return 6 + work_.more.width; }

  /// Light as it looks, beside light as it is: an edge in the shade counts like one in the sun, where it else would
  /// have no triangles (walls that see a window aside had streaks as wide as they are).
  static float as_seen(float x) {
    constexpr float kDim = kOpenConstantBand / 4;  // a quarter of the mean
    constexpr float kWeight = 3;  // the least at which the hotel room's walls were smooth; its error stays the same
    return kWeight * kDim * std::log1p(std::max(0.0F, x) / kDim);
  }

  std::vector<float> columns(std::span<const TransferPoint> batch, const DirectLight& direct) {
    const std::vector<float> more = work_.more.width > 0 ? work_.more.values(batch) : std::vector<float>{};
    const std::vector<Vec3f> light = all_light(batch, direct);
    std::vector<float> out;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Vec3f x = light[i] * scale_;
      out.insert(out.end(), {x.x, x.y, x.z, as_seen(x.x), as_seen(x.y), as_seen(x.z)});
      for (std::size_t k = 0; k < work_.more.width; ++k)
        out.push_back(kOpenConstantBand * more[i * work_.more.width + k]);
    }
    points_ += batch.size();
    log_.advance(std::min(points_, expected_), std::max<std::uint64_t>(1, expected_));
    return out;
  }

  /// Inside solids nothing is reflected: hidden vertices are known by their darkness.
  std::vector<Vec3f> all_light(std::span<const TransferPoint> batch, const DirectLight& direct) {
    constexpr std::size_t kBlock = 128;
    std::uint64_t rays = 0;
    std::vector<Vec3f> light = light_at(batch, direct, seed_, rays, threads_);
    std::vector<char> hidden(batch.size());
    threads_.for_blocks(batch.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) hidden[i] = light[i] == Vec3f{} && hidden_(batch[i]) ? 1 : 0;
    });
    std::vector<TransferPoint> seen;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (hidden[i] == 0) seen.push_back(batch[i]);
    }
    const std::uint64_t gathered = work_.reflected.stats().gather_rays;
    const std::vector<Vec3f> reflected = work_.reflected.at(seen, threads_);
    for (std::size_t i = 0, next = 0; i < batch.size(); ++i) {
      if (hidden[i] == 0) light[i] += reflected[next++];
    }
    log_.count_rays(rays + work_.reflected.stats().gather_rays - gathered);
    return light;
  }

  Work work_;
  BakeLog& log_;
  Threads& threads_;
  std::uint64_t seed_;
  DirectLight light_, rough_;
  HiddenTest hidden_;
  std::uint64_t expected_, points_ = 0;
  float scale_ = 1;
};

/// What subdivision asks for first: vertices, and middles of what is wider than points are apart. Where these see no
/// point one is placed, which is cheaper than that each gathers for itself.
std::vector<TransferPoint> first_places(const Mesh& mesh, float apart) {
  std::vector<TransferPoint> out = vertex_points(mesh);
  for (const Triangle& t : mesh.triangles) {
    const Vec3f middle = (mesh.position[t[0]] + mesh.position[t[1]] + mesh.position[t[2]]) / 3.0F;
    bool wide = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (length(mesh.position[b] - mesh.position[a]) < apart) continue;
      out.push_back(edge_point(mesh, t, std::min(a, b), std::max(a, b), 0.5F));
      wide = true;
    }
    if (!wide) continue;
    const Vec3f face = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
    out.push_back({middle, normalized(mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]], face), middle, face});
  }
  return out;
}

struct Refined {
  const Tracer& tracer;  // of the input
  const Environment* sky;
  const Plan& plan;
  const Mesh& mesh;
};

/// Where errors come from (error_sources.h).
void find_sources(const Refined& r, ReflectedLight& reflected, SolvedRadiosity& out, BakeLog& log, Threads& threads) {
  const Radiosity& params = *r.plan.radiosity;
  const std::vector<std::uint32_t> probes = choose_probes(r.mesh, probes_for(points_of(r.plan, r.tracer.scene())));
  const std::uint64_t gathered = reflected.stats().gather_rays;
  std::uint64_t rays = 0;
  out.noise.direct =
      draw_twice(r.mesh, probes, DirectLight(r.tracer, r.sky, params.direct), params.seed, rays, threads);
  weigh(reflected.probe(points_at(r.mesh, probes), threads), probes, out);
  log.count_rays(rays + reflected.stats().gather_rays - gathered);
  if (params.bounces > 0) out.tail = reflected.stats().tail;
  if (params.bounces == 0) out.tail = measure_bounces(r.tracer, r.plan.lamps, 1, threads).left;
  if (params.bounces < 0) out.tail = kTail;
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
                                            : effort.reason + std::string(" adds triangles where light changes"));
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
  params.light_points = hooks.lit_points != nullptr;
  SolvedRadiosity out;
  const Tracer tracer(scene, threads);  // of the input: scene.mesh changes last

  log.begin("reflected", plan.grid ? 0.25 : 0.45);
  std::vector<TransferPoint> readers =
      first_places(scene.mesh, std::ldexp(params.points.radius, 1 - params.points.levels));
  readers.insert(readers.end(), hooks.places.begin(), hooks.places.end());
  ReflectedLight reflected(tracer, sky, params, readers, threads);
  log.count_rays(reflected.stats().direct_rays + reflected.stats().gather_rays);

  log.begin("light", plan.grid ? 0.4 : 0.85);
  LightSource source({tracer, sky, plan, reflected, hooks.more}, log, threads);
  const ValueSource values = source.source();
  const Mesh base = plan.split ? base_mesh(tracer, plan, values, false, threads) : scene.mesh;
  Subdivided fine = subdivide(base, values, plan.split ? plan.subdivide : Subdivide{.triangles = 0}, threads);
  std::vector<Vec3f> light = source.light_of(fine.values);
  if (hooks.sources) find_sources({tracer, sky, plan, fine.mesh}, reflected, out, log, threads);
  if (hooks.lit_places) {
    const DirectLight direct(tracer, sky, params.direct);
    std::uint64_t rays = 0;
    const auto direct_at = [&](std::span<const TransferPoint> points) {
      return light_at(points, direct, params.seed, rays, threads);
    };
    const std::vector<Vec3f> there = direct_at(hooks.places);
    hooks.lit_places({there, reflected.at(hooks.places, threads), direct_at, tracer});
    log.count_rays(rays);
  }
  const RadiosityStats& stats = reflected.stats();
  for (const std::uint32_t n : stats.gathered) out.gathered += n;
  for (const std::uint32_t n : stats.points) out.points += n;
  decide(plan, "gathered", std::to_string(out.gathered) + " of " + std::to_string(out.points) + " points",
         "what coarser points predict within eps_irradiance is not gathered; " + std::to_string(stats.alone) +
             " places that see none gather for themselves; " + std::to_string(stats.sweeps) + " sweeps");
  if (hooks.lit_points) hooks.lit_points(reflected.points(), reflected.point_light());
  if (hooks.lit) hooks.lit(tracer, reflected.surface(), fine.mesh, light);

  out.transfer = {.order = 0, .channels = 3, .fixed = true, .coefficients = {}};
  out.transfer.coefficients.reserve(3 * light.size());
  for (const Vec3f& x : light) out.transfer.coefficients.insert(out.transfer.coefficients.end(), {x.x, x.y, x.z});
  out.gather_rays = stats.gather_rays;
  scene.mesh = std::move(fine.mesh);
  return out;
}

}  // namespace kiln
