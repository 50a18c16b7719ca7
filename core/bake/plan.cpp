#include "core/bake/plan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/bake/bounce_tail.h"
#include "core/trace/tracer.h"

namespace kiln {
namespace {

bool emits(const Material& material) { return length(material.emission) > 0; }

bool has_lamps(const Scene& scene) {
  if (!scene.lights.empty()) return true;
  return std::any_of(scene.parts.begin(), scene.parts.end(),
                     [&](const Part& part) { return emits(scene.materials[static_cast<std::size_t>(part.material)]); });
}

constexpr const char* kAsked = "asked for by the recipe";

void plan_order(Plan& plan, const PrtStep& step, const Effort& effort) {
  plan.order = step.order.value_or(effort.order);
  decide(plan, "order", std::to_string(plan.order),
         step.order ? kAsked : effort.reason + " keeps " + std::to_string(plan.order) + " bands of distant light");
}

/// What authors may mend: colours left at white.
std::string why_so_many(const BounceTail& tail) {
  constexpr int kMany = 16;
  constexpr double kSome = 0.1;
  if (tail.bounces < kMany || tail.white < kSome) return {};
  return "; " + short_text(100 * tail.white) +
         " % of the surface is whiter than any paint (base colour above 0.95): light in its pockets takes hundreds, "
         "and "
         "there the bake errs most";
}

void plan_bounces(Plan& plan, const Tracer& tracer, const PrtStep& step, const Effort& effort, Threads& threads) {
  if (step.bounces) {
    plan.bounces = *step.bounces;
    plan.bounces_asked = true;
    return decide(plan, "bounces", std::to_string(plan.bounces), kAsked);
  }
  const BounceTail tail = measure_bounces(tracer, plan.lamps, effort.tail, threads);
  plan.bounces = tail.bounces;
  plan.tail_left = tail.left;
  decide(plan, "bounces", std::to_string(plan.bounces),
         plan.bounces == 0 && tail.left == 0 ? "no path finds light by reflection"
                                             : "sample paths bring " + short_text(100 * tail.left) +
                                                   " % of the light in later reflections" + why_so_many(tail));
}

void plan_samples(Plan& plan, const PrtStep& step, const Effort& effort) {
  plan.samples = step.samples.value_or(effort.samples);
  plan.bounce_samples = step.samples ? std::max(16, *step.samples / 4) : effort.bounce_samples;
  plan.lamp_samples = step.samples ? std::max(16, *step.samples / 8) : effort.lamp_samples;
  plan.noise = step.samples ? 0 : effort.noise;
  decide(plan, "samples", std::to_string(plan.samples),
         step.samples ? kAsked
                      : effort.reason + "; a point stops before where " + short_text(100 * plan.noise) +
                            " % of noise is reached");
}

void plan_encoding(Plan& plan, const PrtStep& step, const Effort& effort) {
  using Form = PrtStep::Encoding::Form;
  plan.encoding = step.encoding;
  plan.raw_bits = effort.bits;
  plan.compression = effort.compression;
  if (step.encoding.form != Form::automatic)
    return decide(plan, "encoding", step.encoding.form == Form::raw ? "raw" : "pca", kAsked);
  decide(plan, "encoding", "auto",
         "components if they are smaller than raw coefficients; they may add " + short_text(100 * plan.compression) +
             " % of error");
}

/// As many rays as a transfer vector may take, all of them: a sharp lobe averages few. Storage may add what it may add
/// to the vectors, four times over: lobes blur the bands where most of it lies.
void plan_matrices(Plan& plan, const Scene& scene, const PrtStep& step) {
  GlossyDecision glossy = plan_glossy(scene, step.glossy, plan.order);
  plan.glossy = std::move(glossy.plan);
  plan.glossy.samples = std::clamp(plan.samples, 16, 4096);
  plan.glossy.compression = 4 * plan.compression;
  plan.warnings.insert(plan.warnings.end(), glossy.warnings.begin(), glossy.warnings.end());
  if (plan.glossy && !scene.lights.empty()) {
    plan.warnings.push_back({"glossy_punctual",
                             "Highlights of punctual lights are not baked: specular parts show what such lights do to "
                             "diffuse surfaces.",
                             ""});
  }
  decide(plan, "glossy", glossy.value, glossy.reason);
}

void plan_lamps(Plan& plan, const Scene& scene) {
  plan.lamps = has_lamps(scene);
  decide(plan, "lamps", plan.lamps ? "baked" : "skipped",
         plan.lamps ? "the scene has emitters or punctual lights of its own"
                    : "the scene has neither emitters nor punctual lights");
}

/// The surface may move by a tenth of the error that merging may add.
void plan_merging(Plan& plan, const Scene& scene, const PrtStep& step, const Effort& effort) {
  constexpr double kReach = 0.1, kWorth = 0.6;  // of the triangles: above it there is little to win
  constexpr std::uint64_t kFew = 2000;          // that are gone cost less than finding them
  using Mode = PrtStep::Merge;
  if (step.merge == Mode::off) return decide(plan, "merge", "no", "turned off by the recipe");
  MergePlan merge{.max_error = effort.merging, .max_reach = kReach * effort.merging};
  const std::uint64_t input = scene.mesh.triangles.size();
  const std::uint64_t shape = triangles_for_shape(scene.mesh, merge.max_reach);
  merge.triangles = std::min(input, triangles_for_light(shape));
  if (!step.subdivide.triangles) merge.added = effort.triangles;
  const std::string reason = "within " + short_text(100 * merge.max_reach) +
                             " % of its diagonal the shape needs about " + std::to_string(shape) + " of " +
                             std::to_string(input) + " triangles, and with light at least " +
                             std::to_string(merge.triangles);
  const bool worth =
      static_cast<double>(merge.triangles) < kWorth * static_cast<double>(input) && input - merge.triangles >= kFew;
  if (step.merge == Mode::automatic && !worth)
    return decide(plan, "merge", "no", "the input is coarse for what it shows: " + reason);
  plan.merge = merge;
  decide(plan, "merge", "to about " + std::to_string(merge.triangles) + " triangles",
         step.merge == Mode::on ? kAsked : reason);
}

void plan_subdivision(Plan& plan, const Scene& scene, const PrtStep::Subdivision& asked, const Effort& effort) {
  using Mode = PrtStep::Subdivision::Mode;
  const std::uint64_t given = scene.mesh.triangles.size(), input = plan.merge ? plan.merge->triangles : given;
  const std::uint64_t open = plan.merge ? budget_after(*plan.merge, input, given) : input + effort.triangles;
  const std::uint64_t budget = asked.triangles.value_or(open);
  plan.split = asked.mode != Mode::off && budget > input;
  plan.subdivide = {.measure = asked.measure,
                    .alpha = asked.alpha,
                    .threshold = asked.threshold.value_or(effort.threshold),
                    .triangles = budget,
                    .max_depth = asked.max_depth};
  std::string reason = "the recipe's budget is above the input's " + std::to_string(input) + " triangles";
  if (!asked.triangles) {
    reason = effort.reason + " adds " + std::to_string(budget - input) + " triangles where light changes";
  }
  if (budget <= input) reason = "the input's " + std::to_string(input) + " triangles use up the budget";
  if (asked.mode == Mode::off) reason = "turned off by the recipe";
  decide(plan, "subdivide", plan.split ? "up to " + std::to_string(budget) + " triangles" : "no", reason);
}

}  // namespace

std::string short_text(double x) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%.3g", x);
  return out.data();
}

void decide(Plan& plan, std::string decision, std::string value, std::string reason) {
  plan.decisions.push_back({std::move(decision), std::move(value), std::move(reason)});
}

Effort effort_of(Quality quality) {
  switch (quality) {
    case Quality::draft:
      return {"the draft quality", 4, 256, 64, 64, 0.01, 10'000, 2e-4F, 10, 0.02, 0.01, 0.01};
    case Quality::standard:
      return {"the standard quality", 6, 1024, 256, 256, 0.002, 40'000, 5e-5F, 12, 0.01, 0.005, 0.005};
    case Quality::finest:
      break;
  }
  return {"the final quality", 6, 4096, 1024, 1024, 0.0005, 160'000, 1e-5F, 14, 0.0025, 0.002, 0.00125};
}

// The noise of stratified rays falls nearly as one over their number: about .1 at 16 on the bunny, .015 at 256.
Effort first_effort(const Promise& promise) {
  const double target = promise.target_error.value_or(0.05);
  const int samples = std::clamp(16 * static_cast<int>(std::lround(0.1 / target)), 16, 256);
  Effort effort{"the first pass", target >= 0.05 ? 4 : 6, samples, std::max(16, samples / 4),
                std::max(16, samples / 4)};
  effort.tail = std::clamp(target / 10, 5e-4, 0.02);
  effort.triangles = static_cast<std::uint64_t>(std::clamp(100 / target, 500.0, 10'000.0));
  effort.bits = target >= 0.05 ? 10 : target >= 0.01 ? 12 : 14;
  effort.noise = target / 4;
  effort.merging = target / 4;
  effort.compression = std::clamp(target / 10, 2e-4, 0.01);
  return effort;
}

Plan make_plan(const Scene& scene, const PrtStep& step, const Effort& effort, Threads& threads) {
  Plan plan;
  plan_order(plan, step, effort);
  plan_lamps(plan, scene);
  const Tracer tracer(scene, threads);
  plan_bounces(plan, tracer, step, effort, threads);
  plan_samples(plan, step, effort);
  plan_merging(plan, scene, step, effort);
  plan_subdivision(plan, scene, step.subdivide, effort);
  plan_encoding(plan, step, effort);
  plan_matrices(plan, scene, step);
  plan_meshless(plan, scene, step, effort);
  plan.costs = measure_costs(tracer, plan, threads);
  plan.prediction = predict(plan, scene);
  return plan;
}

}  // namespace kiln
