// A target and a time budget of the step `lightfield`.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/bake/job_light.h"
#include "core/bake/light_field_certificate.h"
#include "core/bake/progressive.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;
using testing::report_of;

/// The column with a knot of brushed metal. Few triangles and rays: what the loop decides is the same.
constexpr const char* kFew = R"(,"rays":128,"subdivide":"off")";
BakeInput brushed(const std::string& quality, const std::string& more = kFew) {
  const std::string recipe = R"({"environment":{"builtin":"courtyard"},"quality":)" + quality +
                             R"(,"steps":[{"do":"lightfield")" + more + "}]}";
  return testing::finished("column", recipe, {{"knot", {{"metallicFactor", 1}, {"roughnessFactor", 0.5}}}});
}

BakeOutput baked(const BakeInput& input, int count = 0, const Checkpoints& checkpoints = {}) {
  Threads threads(count);
  auto output = bake(input, {}, threads, checkpoints);
  EXPECT_TRUE(output) << output.error().message;
  return std::move(*output);
}

TEST(LightFieldPromise, ATargetIsMetByACoarserSurfaceAndHoldsForOtherEyes) {
  const BakeInput input = brushed(R"({"target_error":0.3})");
  const BakeOutput output = baked(input);
  const json report = report_of(output), &field = report["lightfield"];
  EXPECT_EQ(report["promise"]["ended_by"], "target_met") << report["promise"];
  EXPECT_LE(field["certificate"]["interval"][1].get<double>(), 0.3);
  EXPECT_LT(field["levels"][0]["triangles"].get<double>(), 0.9 * field["baked_triangles"].get<double>());
  Threads threads;
  const auto scene = import_scene(input.scene, {});
  const auto decoded = read_baked_glb(file(output, "scene.glb"));
  const Tracer truth(*scene, threads);
  const FieldCertificate other =
      certify_field({.decoded = *decoded, .truth = truth, .environment = *job_light(input), .seed = 99}, threads);
  EXPECT_LE(other.radiance.interval_low, 0.3);
  EXPECT_GT(other.radiance.interval_high, 0.15);  // what is left of the target went into fewer triangles
}

TEST(LightFieldPromise, ALooserTargetIsASmallerFile) {
  const BakeOutput loose = baked(brushed(R"({"target_error":0.6})")),
                   tight = baked(brushed(R"({"target_error":0.25})"));
  EXPECT_LT(file(loose, "scene.glb").size(), file(tight, "scene.glb").size());
}

TEST(LightFieldPromise, PassesAndBytesHangOnNoThreadAndOnNoInterruption) {
  const BakeInput input = brushed(R"({"target_error":0.095})");  // degree 6 has it
  std::vector<std::string> saved;
  const BakeOutput one = baked(input, 1, {{}, [&](const std::string& text) { saved.push_back(text); }});
  ASSERT_GE(saved.size(), 2U);
  const BakeOutput two = baked(input, 2, {saved.front(), {}});
  EXPECT_EQ(file(one, "scene.glb"), file(two, "scene.glb"));
  EXPECT_EQ(report_of(one)["promise"]["passes"].size(), report_of(two)["promise"]["passes"].size());
}

TEST(LightFieldPromise, WhatCannotBeMetIsToldWithTheKnobThatHinders) {
  const BakeOutput output = baked(brushed(R"({"target_error":0.005})", R"(,"degree":2,"rays":64,"subdivide":"off")"));
  const json promise = report_of(output)["promise"];
  EXPECT_EQ(promise["ended_by"], "floor");
  EXPECT_FALSE(promise["kept"].get<bool>());
  EXPECT_NE(promise["reason"].get<std::string>().find("/steps/0/rays"), std::string::npos) << promise["reason"];
}

TEST(LightFieldPromise, ABudgetTooShortForOnePassStillGivesAWholeArtefact) {
  const BakeOutput output = baked(brushed(R"({"time_budget_s":0.01})"));
  EXPECT_TRUE(read_baked_glb(file(output, "scene.glb")).has_value());
  const json promise = report_of(output)["promise"];
  EXPECT_EQ(promise["ended_by"], "time_spent");
  EXPECT_EQ(promise["passes"].size(), 1U);
}

TEST(LightFieldPromise, OfATargetAndATimeTheOneThatComesFirstEndsIt) {
  const json soon = report_of(baked(brushed(R"({"target_error":0.005,"time_budget_s":0.01})")))["promise"];
  EXPECT_EQ(soon["ended_by"], "time_spent") << soon;
  EXPECT_EQ(soon["passes"].size(), 1U);
  EXPECT_GT(soon["passes"][0]["interval"][1].get<double>(), 0.005);
  EXPECT_EQ(soon["target_error"], 0.005);
  EXPECT_EQ(soon["time_budget_s"], 0.01);
  const json easy = report_of(baked(brushed(R"({"target_error":0.6,"time_budget_s":600})")))["promise"];
  EXPECT_EQ(easy["ended_by"], "target_met") << easy;
  EXPECT_TRUE(easy["kept"].get<bool>());
  EXPECT_LE(easy["passes"].back()["interval"][1].get<double>(), 0.6);
}

/// A pass of degree 4 and 256 rays, as the loop sees it.
Plan next_after(const ErrorSources& sources) {
  PassRecord pass;
  pass.order = 4, pass.samples = 256;
  pass.triangles = 10'000, pass.vertices = 6'000;
  pass.rays = 4'000'000, pass.bounce_rays = 3'000'000;
  pass.seconds = 1;
  pass.sources = sources;
  pass.relrmse = std::hypot(sources.noise, sources.interpolation);
  pass.low = 0.9 * pass.relrmse, pass.high = 1.1 * pass.relrmse;
  Passes passes({.target_error = 0.05}, {}, {}, light_field_passes());
  passes.add(pass);
  Plan plan;
  plan.field.emplace();
  plan.field->outgoing.degree = 4, plan.field->outgoing.rays = 256;
  plan.subdivide.triangles = 10'000;
  return *passes.next(plan, Scene{});
}

TEST(LightFieldPromise, ASurfaceThatWasSimplifiedTooFarIsBakedAgainAndNoFiner) {
  PassRecord pass;
  pass.order = 4, pass.samples = 256;
  pass.triangles = 10'000, pass.rays = 4'000'000, pass.bounce_rays = 3'000'000;
  pass.seconds = 1;
  pass.sources = {.noise = 0.01, .interpolation = 0.02, .merging = 0.05};
  pass.relrmse = 0.045, pass.low = 0.03, pass.high = 0.06;
  Passes passes({.target_error = 0.05}, {}, {}, light_field_passes());
  passes.add(pass);
  Plan plan;
  plan.field.emplace();
  plan.field->target = 0.05;
  plan.field->outgoing.rays = 256;
  plan.subdivide.triangles = 10'000;
  const auto next = passes.next(plan, Scene{});
  ASSERT_TRUE(next);
  EXPECT_LT(*next->field->target, 0.05);
  EXPECT_EQ(next->field->outgoing.rays, 256);
  EXPECT_EQ(next->subdivide.triangles, 10'000U);
}

TEST(LightFieldPromise, TheNextPassSpendsOnTheLargestSource) {
  const Plan noisy =
      next_after({.noise = 0.1, .noise_of_reflections = 0.1, .interpolation = 0.01, .truncation = 0.001});
  EXPECT_GT(noisy.field->outgoing.rays, 512);
  EXPECT_EQ(noisy.field->outgoing.degree, 4);
  EXPECT_EQ(noisy.subdivide.triangles, 10'000U);
  const Plan coarse =
      next_after({.noise = 0.01, .noise_of_reflections = 0.01, .interpolation = 0.1, .truncation = 0.01});
  EXPECT_EQ(coarse.field->outgoing.degree, 4);
  EXPECT_GT(coarse.subdivide.triangles, 20'000U);
  const Plan blurred =
      next_after({.noise = 0.01, .noise_of_reflections = 0.01, .interpolation = 0.1, .truncation = 0.08});
  EXPECT_EQ(blurred.field->outgoing.degree, 6);
  EXPECT_LT(blurred.subdivide.triangles, coarse.subdivide.triangles);
}

}  // namespace
}  // namespace kiln
