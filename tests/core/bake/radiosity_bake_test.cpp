// The step `radiosity`, from recipe to certificate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using testing::file;
using testing::input_of;
using testing::report_of;

constexpr const char* kSmall =
    R"({"steps":[{"do":"radiosity","rays":256,"subdivide":{"triangles":8000}}],"quality":"draft"})";

TEST(RadiosityBake, OfAClosedRoomHoldsItsCertificate) {
  Threads threads;
  const auto output = bake(input_of("room", kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const nlohmann::json report = report_of(*output);
  const auto& certificate = report["certificate"];
  ASSERT_EQ(certificate["lightings"].size(), 1U);
  EXPECT_EQ(certificate["lightings"][0]["name"], "job light");
  std::printf("relRMSE %.4f [%.4f, %.4f]\n", certificate["relrmse"].get<double>(),
              certificate["interval"][0].get<double>(), certificate["interval"][1].get<double>());
  // As the same room's `prt` at 8000 triangles in bake_test: what is left is interpolation between vertices.
  EXPECT_LT(certificate["relrmse"].get<double>(), 0.06);
  EXPECT_GT(certificate["interval"][1].get<double>(), 0.0);  // the estimate itself may be 0: noise is taken off
  double sum = 0;  // sources are squares that sum to the certificate's, unless the estimates alone exceed it
  for (const char* name : {"noise", "points", "interpolation", "bounce_tail", "quantisation"}) {
    const double part = report["error_sources"][name];
    EXPECT_GE(part, 0) << name;
    sum += part * part;
  }
  EXPECT_GE(std::sqrt(sum) * (1 + 1e-9), certificate["relrmse"].get<double>());
  if (report["error_sources"]["interpolation"] > 0) {
    EXPECT_NEAR(std::sqrt(sum), certificate["relrmse"].get<double>(), 1e-9);
  }
  EXPECT_EQ(report["parameters"]["rays"], 256);
  EXPECT_GT(report["rays"].get<double>(), 1e5);
}

TEST(RadiosityBake, StoresOneAttributeThatReadsBackAsLight) {
  Threads threads;
  const auto output = bake(input_of("room", kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->transfer.order, 0);
  EXPECT_TRUE(decoded->transfer.fixed);
  EXPECT_LE(decoded->scene.mesh.triangles.size(), 8000U);
  const std::vector<Vec3f> light = values_of(decoded->transfer, {});
  ASSERT_EQ(light.size(), decoded->scene.mesh.position.size());
  EXPECT_TRUE(std::all_of(light.begin(), light.end(), [](const Vec3f& x) { return is_finite(x); }));
  EXPECT_GT(std::max_element(light.begin(), light.end(), [](auto& a, auto& b) { return a.x < b.x; })->x, 0.1F);
  const Bytes& glb = file(*output, "scene.glb");
  const std::string text(glb.begin(), glb.end());
  EXPECT_NE(text.find("\"_RADIOSITY\""), std::string::npos);
  EXPECT_EQ(text.find("_PRT_"), std::string::npos);
}

TEST(RadiosityBake, UnderASkyIsJudgedByTheSkyInFullDetail) {
  Threads threads;
  const auto output = bake(
      input_of(
          "column",
          R"({"environment":{"builtin":"clear"},"steps":[{"do":"radiosity","subdivide":{"triangles":6000}}],"quality":"draft"})"),
      {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto certificate = report_of(*output)["certificate"];
  std::printf("relRMSE %.4f\n", certificate["relrmse"].get<double>());
  // A sun half a degree wide: its shadow's edge lies within one triangle wherever it falls.
  EXPECT_LT(certificate["relrmse"].get<double>(), 0.2);
}

TEST(RadiosityBake, ThreadCountChangesNotOneByteOfTheScene) {
  Threads one(1), three(3);
  const auto a = bake(input_of("room", kSmall), {}, one), b = bake(input_of("room", kSmall), {}, three);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(file(*a, "scene.glb"), file(*b, "scene.glb"));
}

TEST(RadiosityBake, OfASceneWithoutLightIsBlackAndSaysSo) {
  Threads threads;
  const auto output = bake(input_of("column", kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const nlohmann::json report = report_of(*output);
  EXPECT_EQ(report["certificate"]["relrmse"], 0);
  EXPECT_EQ(report["certificate"]["dark"][0], "job light");
  const auto& warnings = report["warnings"];
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const auto& w) { return w["code"] == "no_light"; }));
}

TEST(RadiosityBake, PointsThatNeedMoreMemoryThanAllowedAreRefusedWithNumbers) {
  Threads threads;
  const auto output =
      bake(input_of("room", R"({"steps":[{"do":"radiosity","points":{"radius":1e-7,"levels":5}}]})"), {}, threads);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, "memory_limit");
  EXPECT_NE(output.error().message.find("/steps/0/points/radius"), std::string::npos);
}

TEST(RadiosityBake, RadiusLargerThanTheSceneStillGivesLight) {
  Threads threads;
  const auto output = bake(
      input_of(
          "room",
          R"({"steps":[{"do":"radiosity","points":{"radius":1e6,"levels":1},"subdivide":"off"}],"quality":"draft"})"),
      {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_GT(report_of(*output)["certificate"]["relrmse"].get<double>(), 0);
}

}  // namespace
}  // namespace kiln
