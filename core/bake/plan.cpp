#include "core/bake/plan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/bake/bounce_tail.h"
#include "core/prt/interreflection.h"
#include "core/sphere/sh.h"
#include "core/trace/tracer.h"

namespace kiln {
namespace {

/// What the three words mean. The tail is the light left out beyond the last bounce, relative to all of it.
struct Grade {
  const char* name;
  int order, samples, bounce_samples, lamp_samples;
  double tail;
  std::uint64_t triangles;
  float threshold;  // of the residual measure; see subdivide.h
  int bits;
};
constexpr std::array<Grade, 3> kGrades = {{
    {"draft", 4, 256, 64, 64, 0.01, 10'000, 2e-4F, 10},
    {"standard", 6, 1024, 256, 256, 0.002, 40'000, 5e-5F, 12},
    {"final", 6, 4096, 1024, 1024, 0.0005, 160'000, 1e-5F, 14},
}};

/// Measured on the machine of core/prt/README.md, one thread: million rays a second, and bytes a vertex.
constexpr double kRaysPerSecond = 8e6;
constexpr std::uint64_t kBytesPerTriangle = 160;  // mesh, hierarchy and hash tables

bool emits(const Material& material) { return length(material.emission) > 0; }

bool has_lamps(const Scene& scene) {
  if (!scene.lights.empty()) return true;
  return std::any_of(scene.parts.begin(), scene.parts.end(),
                     [&](const Part& part) { return emits(scene.materials[static_cast<std::size_t>(part.material)]); });
}

std::string text(double x) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%.3g", x);
  return out.data();
}

void decide(Plan& plan, std::string decision, std::string value, std::string reason) {
  plan.decisions.push_back({std::move(decision), std::move(value), std::move(reason)});
}

constexpr const char* kAsked = "asked for by the recipe";

void plan_order(Plan& plan, const PrtStep& step, const Grade& grade) {
  plan.order = step.order.value_or(grade.order);
  decide(plan, "order", std::to_string(plan.order),
         step.order ? kAsked
                    : std::string("the ") + grade.name + " quality keeps " + std::to_string(plan.order) +
                          " bands of distant light");
}

void plan_bounces(Plan& plan, const Scene& scene, const PrtStep& step, const Grade& grade, Threads& threads) {
  if (step.bounces) {
    plan.bounces = *step.bounces;
    return decide(plan, "bounces", std::to_string(plan.bounces), kAsked);
  }
  const BounceTail tail = measure_bounces(Tracer(scene, threads), plan.lamps, grade.tail, threads);
  plan.bounces = tail.bounces;
  decide(plan, "bounces", std::to_string(plan.bounces),
         plan.bounces == 0 && tail.left == 0
             ? "no path finds light by reflection"
             : "sample paths bring " + text(100 * tail.left) + " % of the light in later reflections");
}

void plan_samples(Plan& plan, const PrtStep& step, const Grade& grade) {
  plan.samples = step.samples.value_or(grade.samples);
  plan.bounce_samples = step.samples ? std::max(16, *step.samples / 4) : grade.bounce_samples;
  plan.lamp_samples = step.samples ? std::max(16, *step.samples / 8) : grade.lamp_samples;
  plan.coefficient_bits = step.coefficient_bits.value_or(grade.bits);
  decide(plan, "samples", std::to_string(plan.samples),
         step.samples ? kAsked : std::string("the ") + grade.name + " quality");
}

void plan_lamps(Plan& plan, const Scene& scene) {
  plan.lamps = has_lamps(scene);
  decide(plan, "lamps", plan.lamps ? "baked" : "skipped",
         plan.lamps ? "the scene has emitters or punctual lights of its own"
                    : "the scene has neither emitters nor punctual lights");
}

void plan_subdivision(Plan& plan, const Scene& scene, const PrtStep::Subdivision& asked, const Grade& grade) {
  using Mode = PrtStep::Subdivision::Mode;
  const std::uint64_t input = scene.mesh.triangles.size();
  const std::uint64_t budget = asked.triangles.value_or(input + grade.triangles);
  plan.split = asked.mode != Mode::off && budget > input;
  plan.subdivide = {.measure = asked.measure,
                    .alpha = asked.alpha,
                    .threshold = asked.threshold.value_or(grade.threshold),
                    .triangles = budget,
                    .max_depth = asked.max_depth};
  std::string reason = "the recipe's budget is above the input's " + std::to_string(input) + " triangles";
  if (!asked.triangles) {
    reason = std::string("the ") + grade.name + " quality adds " + std::to_string(grade.triangles) +
             " triangles where light changes";
  }
  if (budget <= input) reason = "the input's " + std::to_string(input) + " triangles use up the budget";
  if (asked.mode == Mode::off) reason = "turned off by the recipe";
  decide(plan, "subdivide", plan.split ? "up to " + std::to_string(budget) + " triangles" : "no", reason);
}

Prediction predict(const Plan& plan, const Scene& scene, int threads) {
  Prediction out;
  const std::uint64_t input_vertices = scene.mesh.position.size(), input = scene.mesh.triangles.size();
  out.triangles = plan.split ? plan.subdivide.triangles : input;
  out.vertices = input_vertices + (plan.split ? (out.triangles - input) : 0);
  const auto slots = static_cast<std::uint64_t>(sh_count(plan.order)) + (plan.lamps ? 1 : 0);
  out.memory_bytes =
      out.vertices * (slots * 3 * 4 * 2 + 200) + (out.triangles + input) * kBytesPerTriangle + (64ULL << 20);
  for (const Image& image : scene.images) out.memory_bytes += image.rgba.size() + image.encoded.size();
  const std::uint64_t per_vertex =
      static_cast<std::uint64_t>(plan.samples + (plan.lamps ? plan.lamp_samples : 0)) +
      rays_per_vertex(Interreflection{.bounces = plan.bounces, .samples = plan.bounce_samples});
  out.rays = out.vertices * per_vertex;
  out.seconds = static_cast<double>(out.rays) / (kRaysPerSecond * std::max(1, threads)) + 0.2;
  out.artifact_bytes = out.vertices * (slots * 3 * static_cast<std::uint64_t>(plan.coefficient_bits) / 16 + 8);
  return out;
}

}  // namespace

Plan make_plan(const Scene& scene, const PrtStep& step, Quality quality, Threads& threads) {
  const Grade& grade = kGrades[static_cast<std::size_t>(quality)];
  Plan plan;
  plan_order(plan, step, grade);
  plan_lamps(plan, scene);
  plan_bounces(plan, scene, step, grade, threads);
  plan_samples(plan, step, grade);
  plan_subdivision(plan, scene, step.subdivide, grade);
  decide(plan, "glossy", "skipped", "this engine models every surface as diffuse with its full reflectance");
  plan.prediction = predict(plan, scene, threads.count());
  return plan;
}

}  // namespace kiln
