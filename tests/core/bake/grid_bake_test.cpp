// The step `grid`, from recipe to certificate.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/artifact/grid_exr.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;
using testing::input_of;
using testing::report_of;

constexpr const char* kSmall = R"({"steps":[{"do":"grid","resolution":[12,12,12],"samples":256}],"quality":"draft"})";

json baked_report(const std::string& scene, const std::string& recipe) {
  Threads threads;
  const auto output = bake(input_of(scene, recipe), {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  return output ? report_of(*output) : json();
}

TEST(GridBake, OfARoomDeliversAGridThatHoldsItsCertificate) {
  Threads threads;
  const auto output = bake(input_of("room", kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto grid = read_grid_exr(file(*output, "grid.exr"), "grid.exr");
  ASSERT_TRUE(grid) << grid.error().message;
  EXPECT_EQ(grid->lattice.size, (std::array<int, 3>{12, 12, 12}));
  EXPECT_EQ(grid->parts.size(), 9U);
  EXPECT_FALSE(grid->cells.empty());
  const json report = report_of(*output)["grid"];
  const json& certificate = report["certificate"];
  EXPECT_EQ(report["bytes"], file(*output, "grid.exr").size());
  // The Cornell box, a room of the same kind, has .03 at 16 vertices (core/grid/README.md); .016 was measured here.
  EXPECT_LT(certificate["relrmse"].get<double>(), 0.05);
  EXPECT_GT(certificate["interval"][1].get<double>(), 0.0);
  EXPECT_GT(certificate["points"].get<int>(), 500);
  const json& sources = certificate["sources"];
  // Half floats add less than a thousandth (issue 5); of the rays' noise .016 was measured, and the fit leaves hardly
  // more.
  EXPECT_LT(sources["storage"].get<double>(), 0.001);
  EXPECT_LT(sources["noise"].get<double>(), 0.03);
  EXPECT_FALSE(report_of(*output)["certificate"].is_null());  // of scene.glb
}

TEST(GridBake, ThreadCountChangesNotOneByte) {
  Threads one(1), three(3);
  const auto a = bake(input_of("room", kSmall), {}, one), b = bake(input_of("room", kSmall), {}, three);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(file(*a, "grid.exr"), file(*b, "grid.exr"));
  EXPECT_EQ(file(*a, "scene.glb"), file(*b, "scene.glb"));
  EXPECT_EQ(report_of(*a)["grid"]["certificate"]["relrmse"], report_of(*b)["grid"]["certificate"]["relrmse"]);
}

TEST(GridBake, KeepsAPromiseByDoublingTheGrid) {
  const json report =
      baked_report("room", R"({"steps":[{"do":"grid"}],"quality":{"target_error":0.12},"limits":{"wall_s":120}})");
  const json& promise = report["promise"];
  EXPECT_EQ(promise["ended_by"], "target_met") << promise.dump();
  EXPECT_TRUE(promise["kept"]);
  EXPECT_LE(report["grid"]["certificate"]["interval"][1].get<double>(), 0.12);
  EXPECT_GE(promise["passes"].size(), 1U);
}

TEST(GridBake, SaysWhenAPromiseCannotBeKept) {
  const json report = baked_report(
      "room", R"({"steps":[{"do":"grid","samples":16}],"quality":{"target_error":0.0001},"limits":{"memory_mb":90}})");
  EXPECT_EQ(report["promise"]["ended_by"], "floor");
  EXPECT_FALSE(report["promise"]["kept"]);
  EXPECT_NE(report["promise"]["reason"].get<std::string>().find("memory"), std::string::npos);
}

TEST(GridBake, OfPaperBlendHasTwelveTextures) {
  Threads threads;
  const auto output =
      bake(input_of("room",
                    R"({"steps":[{"do":"grid","resolution":[6,6,6],"samples":64,"blend":"paper"}],"quality":"draft"})"),
           {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto grid = read_grid_exr(file(*output, "grid.exr"), "grid.exr");
  ASSERT_TRUE(grid) << grid.error().message;
  EXPECT_EQ(grid->parts.size(), 12U);
}

TEST(GridBake, OfASceneWithoutLightIsBlackWithErrorZero) {
  const json report = baked_report("column", kSmall);
  EXPECT_EQ(report["grid"]["certificate"]["relrmse"], 0);
  EXPECT_TRUE(report["grid"]["certificate"]["dark"]);
}

TEST(GridBake, PlanNamesTheGridAndItsBytesAreThoseOfTheFile) {
  Threads threads;
  const json plan = json::parse(*plan_json(input_of("room", kSmall), threads));
  const auto output = bake(input_of("room", kSmall), {}, threads);
  ASSERT_TRUE(output);
  const auto& decisions = plan["plan"];
  EXPECT_TRUE(std::any_of(decisions.begin(), decisions.end(),
                          [](const json& d) { return d["decision"] == "resolution" && d["value"] == "12 x 12 x 12"; }));
  const double predicted = plan["prediction"]["artifact_bytes"];
  const auto bytes = static_cast<double>(file(*output, "grid.exr").size() + file(*output, "scene.glb").size());
  EXPECT_LE(predicted, 1.5 * bytes);
  EXPECT_GE(predicted * 1.5, bytes);
  const double rays = plan["prediction"]["rays"], sent = report_of(*output)["rays"];
  EXPECT_LE(rays, 1.5 * sent);
  EXPECT_GE(rays * 1.5, sent);
}

TEST(GridBake, TooManyVerticesForTheMemoryAreRefusedWithNumbers) {
  Threads threads;
  const auto output =
      bake(input_of("room", R"({"steps":[{"do":"grid","resolution":[512,512,512]}],"limits":{"memory_mb":256}})"), {},
           threads);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, "memory_limit");
  EXPECT_NE(output.error().message.find("/steps/0/resolution"), std::string::npos);
}

}  // namespace
}  // namespace kiln
