#include "core/bake/links_step.h"

#include <algorithm>
#include <cmath>

#include "core/artifact/links_glb.h"
#include "core/bake/radiosity_step.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

/// What the qualities spend. Measured by kiln_transport: README.md of core/meshless.
struct LinksEffort {
  const char* reason;
  int rays;
  float eps;
  LinkOracle oracle;
  double points;               // times the automatic number
  std::uint32_t most_senders;  // where the recipe gives no level
};

/// Of the first pass towards a promise: a quarter of the points of `draft`, whose error is about .15.
LinksEffort links_effort(const Recipe& recipe) {
  if (recipe.promise) return {"the first pass", 256, 0.05F, {.split = 0.01F, .largest = 0.08F}, 0.25, 3000};
  switch (recipe.quality) {
    case Quality::draft:
      return {"the draft quality", 256, 0.05F, {.split = 0.01F, .largest = 0.08F}, 0.5, 6000};
    case Quality::standard:
      return {"the standard quality", 1024, 0.02F, {}, 1, kAutoSenders};
    case Quality::finest:
      break;
  }
  return {"the final quality", 4096, 0.01F, {.split = 0.0015F, .largest = 0.02F}, 2, 40000};
}

/// Area with the backs of double-sided faces, on which senders stand too.
double sending_area(const Scene& scene) {
  double sum = 0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const Material& m = scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[t]].material)];
    sum += (m.double_sided ? 2 : 1) * triangle_area(scene.mesh, scene.mesh.triangles[t]);
  }
  return sum;
}

double points_of(const LinkParams& l, const Scene& scene) {
  return expected_points(sending_area(scene), std::ldexp(double{l.points.radius}, 1 - l.points.levels));
}

std::string links_text(const Plan& plan, const Scene& scene) {
  return "about " + short_text(points_of(*plan.links, scene)) + " points";
}

std::string oracle_text(const LinkOracle& oracle) {
  return short_text(double{oracle.split}) + ", " + short_text(double{oracle.largest});
}

/// Adds the links to a prediction, by points. Seconds a ray, links a row and bytes as measured by kiln_transport.
void add_prediction(Plan& plan, const Scene& scene) {
  constexpr double kSecondsARay = 0.25e-6, kLinksARow = 70, kBytesATerm = 5, kTerms = 10;
  const LinkParams& l = *plan.links;
  const double points = points_of(l, scene), rays = points * l.rays;
  const double senders = std::min(points, double(l.most_senders));
  Prediction& out = plan.prediction;
  const auto whole = [](double x) { return static_cast<std::uint64_t>(std::min(x, 1e18)); };
  out.rays += whole(2 * rays);
  out.seconds += 2 * kSecondsARay * rays + 2e-4 * points;
  const double bytes =
      points * (24 + 8 * kLinksARow) + senders * 16 * 10 + kBytesATerm * kTerms * static_cast<double>(out.vertices);
  out.artifact_bytes += whole(bytes);
  out.memory_bytes += whole(3 * bytes + 12.0 * l.rays * (senders + 4096) + 600 * points);
}

}  // namespace

Plan make_links_plan(const Scene& scene, const Recipe& recipe, const Environment* sky, Threads& threads) {
  const TransportStep& step = *recipe.transport;
  Plan plan = make_radiosity_plan(scene, step.surface,
                                  recipe.promise ? radiosity_effort(recipe.promise) : radiosity_effort(recipe.quality),
                                  sky, threads);
  const LinksEffort effort = links_effort(recipe);
  LinkParams& l = plan.links.emplace();
  l.rays = step.surface.rays.value_or(effort.rays);
  l.eps = static_cast<float>(step.surface.eps_irradiance.value_or(effort.eps));
  l.oracle = effort.oracle;
  l.bounces = step.surface.bounces.value_or(-1);
  l.sender_level = step.sender_level.value_or(-1);
  l.most_senders = effort.most_senders;
  if (step.surface.radius || step.surface.levels) {
    l.points = plan.radiosity->points;
  } else {
    l.points.wanted = static_cast<std::uint64_t>(effort.points * static_cast<double>(resolve({}, scene).wanted));
    l.points = resolve(l.points, scene);
  }
  const std::string asked = "asked for by the recipe";
  decide(plan, "links", links_text(plan, scene),
         "reflected light of lights that move, from senders to receivers; backs of double-sided faces send too");
  decide(plan, "sender_level", l.sender_level < 0 ? "auto" : std::to_string(l.sender_level),
         l.sender_level < 0 ? "the finest with at most " + std::to_string(l.most_senders) + " points" : asked);
  decide(plan, "link rays", std::to_string(l.rays), step.surface.rays ? asked : effort.reason);
  decide(plan, "link oracle", oracle_text(l.oracle),
         effort.reason + std::string(": variation and size, of a receiver's light, above which a link is split"));
  add_prediction(plan, scene);
  return plan;
}

/// Errors of groups fall with the size of what is linked at once, which is as the cells of senders.
void grow_links(Plan& plan, const RadiosityGrowth& growth, const Scene& scene) {
  constexpr double kMostRays = 65536;
  grow_radiosity(plan, growth, scene);
  LinkParams& l = *plan.links;
  l.rays = static_cast<int>(std::min(kMostRays, std::ceil(l.rays * growth.reflected / 16) * 16));
  const auto nearer = static_cast<float>(1 / std::sqrt(growth.points));
  l.points.radius *= nearer;
  l.most_senders = static_cast<std::uint32_t>(std::min(double{kMostSenders}, l.most_senders * growth.points));
  for (LinkOracle* oracle : {&l.oracle, &l.sender_oracle}) oracle->split *= nearer, oracle->largest *= nearer;
  if (!growth.eps_fixed) l.eps *= nearer;
  add_prediction(plan, scene);
  for (Decision& d : plan.decisions) {
    if (d.decision == "link rays") d = {d.decision, std::to_string(l.rays), growth.reason};
    if (d.decision == "links") d = {d.decision, links_text(plan, scene), growth.reason};
    if (d.decision == "sender_level" && l.sender_level < 0)
      d.reason = "the finest with at most " + std::to_string(l.most_senders) + " points";
    if (d.decision == "link oracle") d = {d.decision, oracle_text(l.oracle), growth.reason};
  }
}

PassRecord links_record(const LinksOutcome& links, const Plan& plan, const Mesh& delivered) {
  const LinksCertificate& c = *links.certificate;
  return {.samples = plan.radiosity->direct.sky,
          .bounce_samples = plan.links->rays,
          .triangles = delivered.triangles.size(),
          .vertices = delivered.position.size(),
          .certificate_seconds = c.seconds,
          .points = links.links.senders,
          .gathered = links.links.rows() - links.links.senders,
          .relrmse = c.of_rms.relrmse,
          .low = c.of_rms.interval_low,
          .high = c.of_rms.interval_high,
          .own_relrmse = {},
          .own_high = {},
          .sources = {.noise = c.sources.noise,
                      .noise_of_reflections = c.sources.noise,
                      .interpolation = c.sources.interpolation,
                      .points = std::hypot(c.sources.senders, c.sources.links)}};
}

LinksStep::LinksStep(const Scene& scene, Plan& plan, std::uint64_t seed, BakeLog& log, Threads& threads)
    : plan_(plan),
      log_(log),
      rays_before_(log.rays()),
      scene_(scene),
      tracer_(scene_, threads),
      builder_(
          tracer_,
          [&] {
            LinkParams params = *plan.links;
            params.seed = params.points.seed = seed;
            return params;
          }(),
          threads) {
  log_.count_rays(builder_.stats().rays);
}

std::size_t LinksStep::columns() const { return builder_.probes(); }

std::vector<float> LinksStep::values(std::span<const TransferPoint> points, Threads& threads) const {
  return builder_.probe_light(points, threads);
}

Result<LinksOutcome> LinksStep::finish(Bytes& glb, const BakedScene& decoded, const Recipe& recipe, Threads& threads) {
  const std::uint64_t rays = builder_.stats().rays;
  const LightLinks made = builder_.finish(decoded.scene.mesh, threads);
  log_.count_rays(builder_.stats().rays - rays);
  const std::size_t before = glb.size();
  KILN_TRY(with, add_links(glb, made));
  glb = std::move(with);
  KILN_TRY(read, read_links(glb, decoded));
  LinksOutcome out{
      .links = std::move(read), .stats = builder_.stats(), .bytes = glb.size() - before, .certificate = {}};
  const LinkStats& stats = out.stats;
  decide(plan_, "senders", std::to_string(stats.senders) + " of level " + std::to_string(stats.sender_level),
         std::to_string(out.links.sweeps) + " sweeps among them for all reflections but the last");
  decide(plan_, "receivers", std::to_string(out.links.rows() - out.links.senders),
         "finer points where coarser ones do not predict the light of probe lamps; " + std::to_string(stats.alone) +
             " vertices gather for themselves");
  decide(plan_, "links kept",
         std::to_string(out.links.links.size()) + ", " + short_text(100 * out.links.share_of_possible()) + " %",
         "of a link from each sender to each receiver");
  if (recipe.certificate) {
    out.certificate = certify_links({decoded, out.links, &builder_, tracer_, plan_.links->bounces,
                                     log_.rays() - rays_before_, static_cast<bool>(recipe.promise), recipe.seed},
                                    threads);
    log_.know_error(out.certificate->of_rms.relrmse);
  }
  return out;
}

}  // namespace kiln
