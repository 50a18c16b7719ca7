// The step `transport`, from recipe to certificate.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/artifact/links_glb.h"
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

TEST(LinksBake, CannotBePromisedYet) {
  const auto recipe = parse_recipe(R"({"quality":{"target_error":0.1},"steps":[{"do":"transport"}]})");
  ASSERT_FALSE(recipe);
  EXPECT_EQ(recipe.error()[0].pointer, "/quality");
}

}  // namespace
}  // namespace kiln
