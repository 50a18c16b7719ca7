#include "core/bake/light_field_step.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/stored_transfer.h"
#include "core/bake/kept_apart.h"
#include "core/bake/normal_maps.h"
#include "core/bake/radiosity_step.h"
#include "core/lightfield/polynomial_space.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

/// What the qualities spend.
struct FieldEffort {
  const char* reason;
  int degree, rays;
  std::uint64_t triangles;  // added where light, colour or finish change
  double storage;           // relRMSE that storage may add
};

FieldEffort field_effort(const Recipe& recipe) {
  if (recipe.promise) {
    const double target = recipe.promise.target_error.value_or(0.1);
    return {"the first pass", 4, target < 0.1 ? 256 : 128, 5'000, std::clamp(target / 10, 0.001, 0.02)};
  }
  switch (recipe.quality) {
    case Quality::draft:
      return {"the draft quality", 4, 256, 20'000, 0.02};
    case Quality::standard:
      return {"the standard quality", 6, 1024, 120'000, 0.01};
    case Quality::finest:
      break;
  }
  return {"the final quality", 8, 4096, 500'000, 0.005};
}

/// Of the lit surface that rays find: what they see there is averaged over many.
Quality surface_quality(const Recipe& recipe) {
  if (!recipe.promise) return recipe.quality;
  return recipe.promise.target_error.value_or(0.1) < 0.05 ? Quality::standard : Quality::draft;
}

/// The surface is baked, and shown, with the normals of its vertices.
void decide_normal_maps(Plan& plan, const Scene& scene) {
  const auto maps = find_normal_maps(scene);
  if (!maps) return;
  const std::string tilt = maps->degrees > 0
                               ? "they tilt normals by " + short_text(maps->degrees) + " degrees (root mean square)"
                               : std::string("their images cannot be read");
  decide(plan, "normal maps", "left out", "light fields have the normals of vertices; " + tilt);
  for (const std::size_t m : maps->materials)
    plan.warnings.push_back(
        {"normal_map_not_baked",
         "A light field shows the surface without its normal map, and so does its certificate; " + tilt + ".",
         "/materials/" + std::to_string(m)});
}

TransferPoint first_corner(const Mesh& mesh, const Triangle& t) {
  return {mesh.position[t[0]], mesh.normal[t[0]], mesh.position[t[0]], mesh.normal[t[0]]};
}

}  // namespace

/// On six models at draft, beside other work: .33 to .49 us a ray, 45 to 100 us of
/// simplification a vertex, .09 to .6 bytes a number of what is delivered, 6 to 12 bytes of memory a number.
void add_field_prediction(Plan& plan) {
  constexpr double kSecondsARay = 0.4e-6, kSecondsAVertex = 7e-5, kBytesANumber = 0.2, kMemoryANumber = 12;
  plan.field->surface = plan.prediction;
  const double vertices = static_cast<double>(plan.prediction.vertices);
  const double rays = vertices * 2 * plan.field->outgoing.rays;
  const int d = plan.field->outgoing.degree;
  const double numbers = vertices * 3 * (d + 1) * (d + 1);
  plan.prediction.rays += static_cast<std::uint64_t>(rays);
  plan.prediction.seconds += 1 + kSecondsARay * rays + kSecondsAVertex * vertices;
  plan.prediction.memory_bytes += static_cast<std::uint64_t>(numbers * kMemoryANumber);
  plan.prediction.artifact_bytes += static_cast<std::uint64_t>(numbers * kBytesANumber);
}

void predict_grown_field(Plan& plan, double triangles) {
  Prediction out = plan.field->surface;
  const auto grow = [&](std::uint64_t& x) { x = static_cast<std::uint64_t>(static_cast<double>(x) * triangles); };
  grow(out.triangles), grow(out.vertices), grow(out.rays), grow(out.memory_bytes), grow(out.artifact_bytes);
  out.seconds *= triangles;
  plan.prediction = out;
  add_field_prediction(plan);
}

void decide_simplification(Plan& plan, const Recipe& recipe) {
  const LightFieldStep& step = *recipe.light_field;
  const FieldEffort effort = field_effort(recipe);
  const LightFieldStep::Simplification& s = step.simplify;
  FieldPlan& f = *plan.field;
  f.storage = effort.storage;
  f.lods = step.lods;
  f.progressive = step.progressive;
  if (s.off) return decide(plan, "simplify", "no", "turned off by the recipe");
  Simplify& out = f.simplify.emplace();
  out.geometry_weight = s.geometry_weight;
  out.collapse = s.collapse;
  const bool asked = s.ratio || s.triangles || s.max_error;
  if (recipe.promise.target_error && !asked) {
    f.target = recipe.promise.target_error;
    return decide(plan, "simplify", "as far as the target allows",
                  "ever coarser levels are certified until one is above " + short_text(100 * *f.target) + " %");
  }
  f.ratio = s.ratio;
  if (s.triangles) out.triangles = *s.triangles;
  if (s.max_error || !asked) out.max_error = s.max_error.value_or(effort.storage);
  decide(
      plan, "simplify",
      s.ratio       ? "to " + short_text(100 * *s.ratio) + " %"
      : s.triangles ? "to " + std::to_string(*s.triangles) + " triangles"
                    : "by at most " + short_text(100 * out.max_error) + " % of the light",
      asked ? "asked for by the recipe" : effort.reason + std::string(" merges vertices that the light does not need"));
}

Plan make_light_field_plan(const Scene& scene, const Recipe& recipe, const Environment* sky, Threads& threads) {
  const LightFieldStep& step = *recipe.light_field;
  const FieldEffort effort = field_effort(recipe);
  RadiosityStep surface = step.surface;
  if (!surface.subdivide.triangles) surface.subdivide.triangles = scene.mesh.triangles.size() + effort.triangles;
  if (recipe.promise && !surface.subdivide.threshold) surface.subdivide.threshold = 0;
  Plan plan = make_radiosity_plan(scene, surface, radiosity_effort(surface_quality(recipe)), sky, threads);
  FieldPlan& f = plan.field.emplace();
  f.outgoing.degree = step.degree.value_or(effort.degree);
  f.outgoing.rays = step.rays.value_or(effort.rays);
  f.outgoing.seed = recipe.seed;
  const std::string asked = "asked for by the recipe";
  if (!step.surface.subdivide.triangles) {
    for (Decision& d : plan.decisions) {
      if (d.decision == "subdivide" && plan.split)
        d.reason = effort.reason + std::string(" adds triangles where direct light, colour or finish change");
    }
  }
  f.basis = step.basis;
  if (f.basis == RadianceBasis::polynomials)
    decide(plan, "basis", "polynomial", asked + ": even in the height above the surface, kept as harmonics");
  decide(plan, "degree", std::to_string(f.outgoing.degree), step.degree ? asked : effort.reason);
  decide(plan, "rays of a vertex", std::to_string(f.outgoing.rays),
         (step.rays ? asked : std::string(effort.reason)) + ": one gather serves all eyes");
  const ApartDecision part = decide_sky(scene, sky, f.outgoing.degree, effort.storage, step.sky);
  f.outgoing.sky_apart = part.apart;
  decide(plan, "sky", part.apart ? "apart" : "in the series", part.reason);
  const ApartDecision lamps = decide_lamps(scene);
  f.outgoing.lamps_apart = lamps.apart;
  decide(plan, "lamps", lamps.apart ? "apart" : "in the series", lamps.reason);
  const ApartDecision emission = decide_emission(scene);
  f.outgoing.emission_apart = emission.apart;
  if (emission.apart) decide(plan, "emission", "apart", emission.reason);
  const ApartDecision diffuse = decide_diffuse(scene);
  f.outgoing.diffuse_apart = diffuse.apart;
  if (diffuse.apart) decide(plan, "diffuse light", "apart", diffuse.reason);
  if (const auto softened = softened_emitters(scene, f.outgoing.degree)) {
    decide(plan, "emitters", "in the series", *softened);
    plan.warnings.push_back({"emitters_mirrored_softly", "Of this scene " + *softened + ".", "/steps/0/degree"});
  }
  decide_normal_maps(plan, scene);
  decide_simplification(plan, recipe);
  add_field_prediction(plan);
  return plan;
}

FinishSource::FinishSource(const Scene& scene)
    : scene_(scene),
      nearest_(scene_.mesh),
      glow_apart_(decide_emission(scene).apart),
      diffuse_apart_(decide_diffuse(scene).apart) {
  std::vector<TransferPoint> points;
  for (const Triangle& t : scene_.mesh.triangles) points.push_back(first_corner(scene_.mesh, t));
  scale_.fill(1);
  Threads one(1);
  const std::vector<float> plain = values(points, one);
  for (std::size_t k = 0; k < kWidth; ++k) {
    double sum = 0;
    for (std::size_t i = k; i < plain.size(); i += kWidth) sum += double{plain[i]};
    const double mean = sum * kWidth / static_cast<double>(std::max<std::size_t>(1, plain.size()));
    // A colour that hardly occurs is no reason to split.
    scale_[k] = static_cast<float>(1 / std::max(mean, 0.05));
  }
}

std::vector<float> FinishSource::values(std::span<const TransferPoint> points, Threads& threads) const {
  std::vector<float> out(points.size() * kWidth);
  threads.for_blocks(points.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto match = nearest_.query(to_double(points[i].position), to_double(points[i].normal));
      if (!match) continue;
      const SurfacePoint p =
          surface_point(scene_, match->triangle, static_cast<float>(match->u), static_cast<float>(match->v));
      const SurfaceFinish finish = finish_at(scene_, p);
      Vec3f color = albedo_at(scene_, p);
      if (diffuse_apart_) color = color * static_cast<float>(finish.metallic);
      const Vec3f glow = glow_apart_ ? Vec3f{} : emission_at(scene_, p);
      const std::array<float, kWidth> numbers{color.x, color.y, color.z,         glow.x,
                                              glow.y,  glow.z,  finish.metallic, finish.roughness};
      for (std::size_t k = 0; k < kWidth; ++k) out[i * kWidth + k] = numbers[k] * scale_[k];
    }
  });
  return out;
}

OutgoingLight bake_light_field(const IncidentLight::World& world, const LitVertices& vertices, const Plan& plan,
                               BakeLog& log, Threads& threads) {
  OutgoingBake params = plan.field->outgoing;
  params.progress = [&](std::uint64_t done, std::uint64_t all) { log.advance(done, all); };
  OutgoingLight out = bake_outgoing(world, vertices, params, threads);
  log.count_rays(out.rays);
  if (plan.field->basis == RadianceBasis::polynomials) keep_polynomials(out.field, vertices.scene.mesh.normal, threads);
  return out;
}

TransferEncoding choose_field_encoding(const LightField& field, const Mesh& mesh, const Plan& plan) {
  Transfer shape = field_shape(field.degree);
  shape.coefficients = field.coefficients;
  // The metric of components is made for light of mean 1.
  double sum = 0;
  for (std::size_t v = 0; v < field.vertices(); ++v) {
    const std::vector<double> rgb = mean_light(field, v);
    sum += rgb[0] + rgb[field.count()] + rgb[2 * field.count()];
  }
  const double mean = std::abs(sum) / static_cast<double>(3 * field.vertices());
  const auto scale = static_cast<float>(mean > 1e-30 ? 1 / mean : 1);
  for (float& c : shape.coefficients) c *= scale;
  // Each coefficient counts as the radiance that it adds, in the mean over all directions.
  const std::vector<double> even(static_cast<std::size_t>(shape.order), 4 * std::numbers::pi);
  const ComponentAnalysis analysis = analyse_components(shape, mesh, even);
  const double share = plan.field->storage / std::sqrt(2.0);
  const auto found = std::ranges::find_if(analysis.left_out, [&](double left) { return left <= share; });
  const auto rank = std::max<std::size_t>(1, static_cast<std::size_t>(found - analysis.left_out.begin()));
  TransferEncoding out{.components = analysis.first(rank), .weights = analysis.weights(shape, rank)};
  for (float& c : out.components.rows) c /= scale;
  out.weight_step = share * std::sqrt(12.0 / static_cast<double>(rank));
  return out;
}

}  // namespace kiln
