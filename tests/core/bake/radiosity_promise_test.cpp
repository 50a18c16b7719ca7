// A target and a time budget of the step `radiosity`, and where its error comes from.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/bake/certificate.h"
#include "core/bake/job_light.h"
#include "core/bake/progressive.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;
using testing::input_of;
using testing::report_of;

BakeInput column(const std::string& quality, const std::string& more = "") {
  return input_of("column", R"({"environment":{"builtin":"clear"},"quality":)" + quality +
                                R"(,"steps":[{"do":"radiosity")" + more + "}]}");
}

BakeOutput baked(const BakeInput& input, int count = 0, const Checkpoints& checkpoints = {}) {
  Threads threads(count);
  auto output = bake(input, {}, threads, checkpoints);
  EXPECT_TRUE(output) << output.error().message;
  return std::move(*output);
}

double square(const json& x) { return x.get<double>() * x.get<double>(); }

TEST(RadiosityPromise, ATargetIsMetByTheSameBytesOnAnyThreadsAndAfterAnInterruptionAndHoldsAtOtherPoints) {
  const BakeInput input = column(R"({"target_error":0.08})");
  std::vector<std::string> saved;
  const BakeOutput output = baked(input, 1, {{}, [&](const std::string& text) { saved.push_back(text); }});
  const json report = report_of(output);
  EXPECT_EQ(report["promise"]["ended_by"], "target_met") << report["promise"];
  EXPECT_LE(report["certificate"]["interval"][1].get<double>(), 0.08);
  EXPECT_GT(report["promise"]["passes"][0]["gathered"].get<int>(), 0);
  ASSERT_GE(saved.size(), 2U);
  const BakeOutput resumed = baked(input, 2, {saved.front(), {}});
  EXPECT_EQ(file(output, "scene.glb"), file(resumed, "scene.glb"));
  EXPECT_EQ(report_of(resumed)["promise"]["passes"].size(), saved.size());

  Threads threads;
  const auto scene = import_scene(input.scene, {});
  const auto decoded = read_baked_glb(file(output, "scene.glb"));
  const Tracer truth(*scene, threads);
  EXPECT_LE(certify(*decoded, truth, *job_light(input), {.seed = 99}, threads).transport.interval_low, 0.08);
}

TEST(RadiosityPromise, ReflectionsThatTheRecipeLeavesOutAreToldWithTheirKnob) {
  const json promise =
      report_of(baked(column(R"({"target_error":0.005})", R"(,"bounces":0,"rays":64,"subdivide":"off")")))["promise"];
  EXPECT_EQ(promise["ended_by"], "floor") << promise;
  EXPECT_FALSE(promise["kept"].get<bool>());
  EXPECT_EQ(promise["passes"].size(), 1U);
  EXPECT_NE(promise["reason"].get<std::string>().find("/steps/0/bounces"), std::string::npos) << promise["reason"];
}

/// The noise of gathers is seen where nothing else differs: the same points and vertices with many more rays. One pair
/// of bakes tells it to a third only, since both judge the same interpolation (.021 to .045 of seeds 1 to 8, whose mean
/// is .034); eight tell it to a tenth. What the report says, .023, has the last reflection alone.
TEST(RadiosityPromise, NoiseOfReflectionsIsWhatMoreRaysTakeAway) {
  const auto run = [](int seed, int rays) {
    const std::string step = R"({"quality":"draft","steps":[{"do":"radiosity","subdivide":"off","eps_irradiance":0,)"
                             R"("points":{"radius":0.5,"levels":3},"rays":)" +
                             std::to_string(rays) + R"(}],"seed":)" + std::to_string(seed) + "}";
    return report_of(baked(input_of("room", step)));
  };
  double taken = 0, told = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    const json few = run(seed, 16), many = run(seed, 256);
    taken += (square(few["certificate"]["relrmse"]) - square(many["certificate"]["relrmse"])) / 8;
    told += square(few["error_sources"]["noise_of_reflections"]) / 8;
  }
  EXPECT_LT(told, 1.1 * 1.1 * taken);
  EXPECT_GT(told, 0.55 * 0.55 * taken);
}

/// A pass of 256 sky rays, gathers of 128 rays and 4000 points, as the loop sees it.
PassRecord pass_with(const ErrorSources& sources) {
  PassRecord pass;
  pass.samples = 256, pass.bounce_samples = 128;
  pass.triangles = 10'000, pass.points = 4000, pass.gathered = 3000;
  pass.rays = 2'000'000, pass.bounce_rays = 500'000;
  pass.seconds = 1;
  pass.sources = sources;
  pass.relrmse = std::hypot(sources.noise, sources.interpolation, sources.points);
  pass.low = 0.9 * pass.relrmse, pass.high = 1.1 * pass.relrmse;
  return pass;
}

Plan plan_of_pass() {
  Plan plan;
  plan.radiosity.emplace();
  plan.radiosity->direct = {{64, 256}, 256}, plan.radiosity->rays = 128;
  plan.radiosity->points.radius = 0.1F, plan.radiosity->points.levels = 5;
  plan.subdivide.triangles = 10'000;
  return plan;
}

Plan next_after(const ErrorSources& sources, const FixedKnobs& fixed = {.order = true}) {
  Passes passes({.target_error = 0.02}, fixed, {}, radiosity_passes());
  passes.add(pass_with(sources));
  return *passes.next(plan_of_pass(), Scene{});
}

TEST(RadiosityPromise, TheNextPassSpendsOnTheLargestSource) {
  const Plan noisy = next_after({.noise = 0.05, .noise_of_reflections = 0.05, .interpolation = 0.005});
  EXPECT_GT(noisy.radiosity->rays, 256);
  EXPECT_EQ(noisy.radiosity->direct.sky, 256);
  EXPECT_EQ(noisy.radiosity->points.radius, 0.1F);
  const Plan dim = next_after({.noise = 0.05, .interpolation = 0.005});
  EXPECT_EQ(dim.radiosity->rays, 128);
  EXPECT_GT(dim.radiosity->direct.sky, 512);
  EXPECT_GT(dim.radiosity->direct.lamps.many, 512);
  const Plan far = next_after({.noise = 0.002, .interpolation = 0.002, .points = 0.03});
  EXPECT_LT(far.radiosity->points.radius, 0.08F);
  EXPECT_LT(far.radiosity->eps, 0.02F);
  EXPECT_EQ(far.radiosity->rays, 128);
  EXPECT_EQ(far.subdivide.triangles, 10'000U);
  const Plan coarse = next_after({.noise = 0.005, .interpolation = 0.05});
  EXPECT_GT(coarse.subdivide.triangles, 20'000U);
  EXPECT_EQ(coarse.radiosity->points.radius, 0.1F);
}

TEST(RadiosityPromise, WhatTheRecipeFixesStays) {
  const ErrorSources all{.noise = 0.05, .noise_of_reflections = 0.03, .interpolation = 0.03, .points = 0.04};
  const Plan plan = next_after(all, {.order = true, .reflected = true, .points = true, .eps = true});
  EXPECT_EQ(plan.radiosity->rays, 128);
  EXPECT_EQ(plan.radiosity->points.radius, 0.1F);
  EXPECT_EQ(plan.radiosity->eps, 0.02F);
  EXPECT_GT(plan.radiosity->direct.sky, 256);
}

TEST(RadiosityPromise, APromiseThatNothingIsLeftToSpendOnNamesTheKnob) {
  for (const auto& [sources, knob] :
       {std::pair{ErrorSources{.noise = 0.05, .noise_of_reflections = 0.05}, "/steps/0/rays"},
        std::pair{ErrorSources{.points = 0.05}, "/steps/0/points/radius"},
        std::pair{ErrorSources{.interpolation = 0.05}, "/steps/0/subdivide"}}) {
    Passes passes({.target_error = 0.02}, {.reflected = true, .points = true, .triangles = true}, {},
                  radiosity_passes());
    passes.add(pass_with(sources));
    EXPECT_FALSE(passes.next(plan_of_pass(), Scene{}));
    EXPECT_EQ(passes.outlook().ending, Outlook::Ending::floor);
    EXPECT_NE(passes.outlook().reason.find(knob), std::string::npos) << passes.outlook().reason;
  }
}

}  // namespace
}  // namespace kiln
