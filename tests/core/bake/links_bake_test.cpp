// The step `transport`, from recipe to certificate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/artifact/links_glb.h"
#include "core/bake/links_certificate.h"
#include "core/bake/progressive.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using testing::file;
using testing::input_of;
using testing::report_of;

constexpr const char* kSmall = R"({"steps":[{"do":"transport","rays":256,"subdivide":{"triangles":8000}}],
                                  "quality":"draft"})";

TEST(LinksBake, OfARoomHoldsItsCertificate) {
  Threads threads;
  const auto output = bake(input_of("room", kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const nlohmann::json links = report_of(*output)["links"];
  const auto& certificate = links["certificate"];
  std::printf("relRMSE %.4f [%.4f, %.4f], of rms %.4f, bias %.4f\n", certificate["relrmse"].get<double>(),
              certificate["interval"][0].get<double>(), certificate["interval"][1].get<double>(),
              certificate["of_rms"].get<double>(), certificate["bias"].get<double>());
  EXPECT_GE(certificate["lamps"].size(), 8U);
  // Measured .12 at draft: the resolution of senders near lamps, 256 rays, and 8000 triangles.
  EXPECT_LT(certificate["relrmse"].get<double>(), 0.2);
  EXPECT_LT(std::abs(certificate["bias"].get<double>()), 0.05);
  EXPECT_LT(links["share_of_possible"].get<double>(), 0.02);
  double sum = 0;  // sources are squares that sum to the square of of_rms
  for (const auto& [name, part] : certificate["sources"].items()) {
    EXPECT_GE(part.get<double>(), 0) << name;
    sum += part.get<double>() * part.get<double>();
  }
  EXPECT_NEAR(std::sqrt(sum), certificate["of_rms"].get<double>(), 1e-9);
  EXPECT_GT(certificate["sources"]["noise"].get<double>(), 0);
}

TEST(LinksBake, DeliversLinksForTheVerticesOfTheFile) {
  Threads threads;
  const auto output = bake(input_of("room", kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const Bytes& glb = file(*output, "scene.glb");
  const auto decoded = read_baked_glb(glb);
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->transfer.order, 0);
  const auto links = read_links(glb, *decoded);
  ASSERT_TRUE(links) << links.error().message;
  EXPECT_EQ(links->vertices(), decoded->scene.mesh.position.size());
  const Tracer tracer(decoded->scene, threads);
  const Light lamp{.intensity = {1, 1, 1}, .position = {0.05F, 0.1F, 0.05F}};
  const auto light = reflected_light(*links, lamp, tracer, decoded->scene.mesh.normal, threads);
  EXPECT_TRUE(std::all_of(light.begin(), light.end(), [](const Vec3f& x) { return is_finite(x) && x.x >= 0; }));
  EXPECT_GT(std::max_element(light.begin(), light.end(), [](auto& a, auto& b) { return a.x < b.x; })->x, 0.01F);
}

TEST(LinksBake, ThreadCountChangesNotOneByteOfTheScene) {
  Threads one(1), three(3);
  const auto a = bake(input_of("room", kSmall), {}, one), b = bake(input_of("room", kSmall), {}, three);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(file(*a, "scene.glb"), file(*b, "scene.glb"));
}

TEST(LinksBake, WithoutReflectionsHasNoneAndSaysSo) {
  Threads threads;
  const auto output =
      bake(input_of("room", R"({"steps":[{"do":"transport","bounces":0}],"quality":"draft"})"), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const nlohmann::json links = report_of(*output)["links"];
  EXPECT_EQ(links["links"], 0);
  EXPECT_EQ(links["certificate"]["relrmse"], 0.0);
}

TEST(LinksBake, OfRadiiOfNoUseIsRefusedWithNumbersOrHasFewPoints) {
  Threads threads;
  const auto tiny = bake(
      input_of("room", R"({"steps":[{"do":"transport","points":{"radius":0.0001,"levels":1}}],"quality":"draft"})"), {},
      threads);
  ASSERT_FALSE(tiny);
  EXPECT_EQ(tiny.error().code, "memory_limit");
  EXPECT_NE(tiny.error().message.find("MB"), std::string::npos);
  const auto huge = bake(
      input_of("room",
               R"({"steps":[{"do":"transport","points":{"radius":1000,"levels":1},"rays":64}],"quality":"draft"})"),
      {}, threads);
  ASSERT_TRUE(huge) << huge.error().message;
  EXPECT_LT(report_of(*huge)["links"]["senders"].get<int>(), 100);
}

TEST(LinksPromise, ATargetIsMetByTheSameBytesOnAnyThreadsAndAfterAnInterruptionAndHoldsForOtherLamps) {
  Threads one(1), two(2);
  const BakeInput input = input_of("column", R"({"steps":[{"do":"transport"}],"quality":{"target_error":0.13}})");
  std::vector<std::string> saved;
  const auto output = bake(input, {}, one, {{}, [&](const std::string& text) { saved.push_back(text); }});
  ASSERT_TRUE(output) << output.error().message;
  const nlohmann::json report = report_of(*output), &promise = report["promise"];
  EXPECT_EQ(promise["ended_by"], "target_met") << promise;
  EXPECT_LE(report["links"]["certificate"]["of_rms_interval"][1].get<double>(), 0.13);
  ASSERT_GE(saved.size(), 2U);
  const auto resumed = bake(input, {}, two, {saved.front(), {}});
  ASSERT_TRUE(resumed);
  EXPECT_EQ(file(*output, "scene.glb"), file(*resumed, "scene.glb"));
  EXPECT_EQ(report_of(*resumed)["promise"]["passes"].size(), saved.size());

  const auto scene = import_scene(input.scene, {});
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  const auto links = read_links(file(*output, "scene.glb"), *decoded);
  ASSERT_TRUE(links);
  const Tracer truth(*scene, two);
  const LinksCheck check{.decoded = *decoded, .links = *links, .builder = nullptr, .truth = truth, .seed = 99};
  EXPECT_LE(certify_links(check, two).of_rms.interval_low, 0.13);
}

TEST(LinksPromise, TheNextPassSpendsOnTheLargestSource) {
  const auto next_after = [](const ErrorSources& sources) {
    PassRecord pass{.samples = 128, .bounce_samples = 256, .triangles = 10'000};
    pass.points = 3000, pass.rays = 4'000'000, pass.bounce_rays = 1'000'000, pass.seconds = 1;
    pass.sources = sources;
    pass.relrmse = std::hypot(sources.noise, sources.interpolation, sources.points);
    pass.low = 0.9 * pass.relrmse, pass.high = 1.1 * pass.relrmse;
    Passes passes({.target_error = 0.05}, {.order = true, .direct = true}, {}, links_passes());
    passes.add(pass);
    Plan plan;
    plan.radiosity.emplace();
    plan.radiosity->points.radius = 0.1F, plan.radiosity->points.levels = 5;
    LinkParams& l = plan.links.emplace();
    l.rays = 256, l.most_senders = 3000, l.points = plan.radiosity->points;
    plan.subdivide.triangles = 10'000;
    return *passes.next(plan, Scene{});
  };
  const Plan noisy = next_after({.noise = 0.1, .noise_of_reflections = 0.1, .interpolation = 0.01});
  EXPECT_GT(noisy.links->rays, 512);
  EXPECT_EQ(noisy.links->most_senders, 3000U);
  const Plan coarse = next_after({.noise = 0.005, .noise_of_reflections = 0.005, .points = 0.06});
  EXPECT_EQ(coarse.links->rays, 256);
  EXPECT_GT(coarse.links->most_senders, 4500U);
  EXPECT_LT(coarse.links->points.radius, 0.085F);
  const Plan flat = next_after({.noise = 0.01, .noise_of_reflections = 0.01, .interpolation = 0.1});
  EXPECT_GT(flat.subdivide.triangles, 20'000U);
  EXPECT_EQ(flat.links->most_senders, 3000U);
}

}  // namespace
}  // namespace kiln
