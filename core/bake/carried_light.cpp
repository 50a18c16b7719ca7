#include "core/bake/carried_light.h"

#include <chrono>

#include "core/bake/field_eye.h"
#include "core/bake/light_field_step.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::size_t kPoints = 8192;

/// What the recipe asks of a bake that is none.
void warn_of_unused(const LightFieldStep& step, bool sky, Plan& plan) {
  std::string unused;
  const auto list = [&](bool asked, const char* name) {
    if (asked) unused += (unused.empty() ? "" : ", ") + std::string(name);
  };
  list(step.basis != RadianceBasis::harmonics, "basis");
  list(step.sky != SkyPart::automatic, "sky");
  list(step.degree.has_value(), "degree");
  list(step.rays.has_value(), "rays");
  list(step.surface.bounces.has_value(), "bounces");
  list(step.surface.subdivide.triangles.has_value(), "subdivide");
  if (!unused.empty())
    plan.warnings.push_back(
        {"recipe_not_used", "The file carries its light; these have no effect: " + unused + ".", "/steps/0"});
  if (sky)
    plan.warnings.push_back(
        {"environment_not_used", "The file carries its light; no environment lights it.", "/environment"});
}

}  // namespace

Plan make_carried_plan(const CarriedScene& in, const Recipe& recipe, bool sky) {
  Plan plan;
  plan.order = 0;
  const std::string vertices = std::to_string(in.scene.mesh.position.size());
  FieldPlan& field = plan.field.emplace();
  field.carried = true;
  field.outgoing.degree = in.field.degree;
  field.outgoing.rays = 0;
  decide(plan, "light", "that of the file", "carried by its " + vertices + " vertices; nothing is traced");
  decide(plan, "degree", std::to_string(in.field.degree), "carried by the file");
  decide_simplification(plan, recipe);
  warn_of_unused(*recipe.light_field, sky, plan);
  plan.prediction.vertices = in.scene.mesh.position.size();
  plan.prediction.triangles = in.scene.mesh.triangles.size();
  add_field_prediction(plan);
  return plan;
}

FieldCertificate certify_carried(const CarriedCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const Mesh& mesh = check.decoded.scene.mesh;
  const ClosestPoint nearest(check.surface.mesh);
  const FieldEye file(check.decoded), input(check.surface, check.field, check.sky);
  const std::uint64_t seed = mix64(check.seed ^ 0x63617272696564ULL);
  const std::vector<SurfaceSample> samples = sample_surface(mesh, kPoints, seed);
  std::vector<Vec3d> shown(samples.size()), truth(samples.size());
  std::vector<std::uint8_t> found(samples.size());
  threads.for_blocks(samples.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfaceSample& s = samples[i];
      const SurfaceMatch here{s.triangle, s.u, s.v, 0};
      const Vec3d normal = match_normal(mesh, here);
      const auto match = nearest.query(match_position(mesh, here), normal);
      if (!match) continue;
      found[i] = 1;
      Random random(seed, i);
      const Vec3d there = match_normal(check.surface.mesh, *match), view = random_view(there, random);
      shown[i] = file.seen(here, normal, view);
      truth[i] = input.seen(*match, there, view);
    }
  });
  std::size_t points = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (found[i] == 0) continue;  // no surface of the input looks that way there
    shown[points] = shown[i], truth[points] = truth[i], ++points;
  }
  shown.resize(points), truth.resize(points);
  FieldCertificate out;
  out.points = points;
  out.radiance = compute_error({shown, truth, {}, points}, {.seed = check.seed});
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
