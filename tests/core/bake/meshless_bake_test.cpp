// The solver of points from recipe to report.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;
using testing::finished;
using testing::report_of;

std::string recipe_of(const std::string& more, bool certificate = true) {
  return R"({"environment":{"builtin":"overcast"},"quality":"draft","certificate":)" +
         std::string(certificate ? "true" : "false") +
         R"(,"steps":[{"do":"prt","samples":128,"bounces":2,"subdivide":{"triangles":3000})" + more + "}]}";
}

const json kMetalKnot = {{"knot", {{"metallicFactor", 1}, {"roughnessFactor", 0.5}}}};
constexpr const char* kMeshless = R"(,"solver":"meshless")";

TEST(MeshlessBake, IsCertifiedLikeTheSolverAtVerticesAndSaysWhatItTook) {
  Threads threads;
  const auto points = bake(finished("column", recipe_of(kMeshless), kMetalKnot), {}, threads);
  const auto vertices = bake(finished("column", recipe_of(""), kMetalKnot), {}, threads);
  ASSERT_TRUE(points && vertices);
  const json report = report_of(*points), other = report_of(*vertices);
  const auto of = [](const json& r, const char* part) { return r["glossy"][part]["relrmse"].get<double>(); };
  std::printf("diffuse %.4f and %.4f, transport of matrices %.4f and %.4f\n",
              report["certificate"]["relrmse"].get<double>(), other["certificate"]["relrmse"].get<double>(),
              of(report, "transport"), of(other, "transport"));
  EXPECT_LT(report["certificate"]["relrmse"], 1.3 * other["certificate"]["relrmse"].get<double>());
  EXPECT_LT(of(report, "radiance"), 1.3 * of(other, "radiance"));
  const json& m = report["meshless"];
  EXPECT_EQ(m["reflections"]["points"].size(), m["reflections"]["levels"]);
  EXPECT_GT(m["reflections"]["gather_rays"], 0);
  EXPECT_GT(m["matrices"]["all"], 0);
  EXPECT_LT(m["matrices"]["all"].get<double>(), 0.5 * m["matrices"]["vertices"].get<double>());
  for (const char* stage : {"rays", "basis"}) EXPECT_TRUE(m["matrices"]["seconds"].contains(stage));
  for (const char* stage : {"gather", "basis", "sweeps"}) EXPECT_TRUE(m["reflections"]["seconds"].contains(stage));
  EXPECT_FALSE(other.contains("meshless"));
  EXPECT_GT(report["error_sources"]["noise_of_reflections"], 0);
}

TEST(MeshlessBake, ThreadCountChangesNotOneByte) {
  Threads one(1), three(3);
  const auto a = bake(finished("column", recipe_of(kMeshless, false), kMetalKnot), {}, one);
  const auto b = bake(finished("column", recipe_of(kMeshless, false), kMetalKnot), {}, three);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(file(*a, "scene.glb"), file(*b, "scene.glb"));
}

TEST(MeshlessBake, PointsThatNoMemoryHoldsAreRefusedWithNumbers) {
  Threads threads;
  for (const char* radius : {"1e-9", "1e-3"}) {
    const std::string points = std::string(R"(,"solver":"meshless","points":{"levels":12,"radius":)") + radius + "}";
    const auto refused = bake(finished("column", recipe_of(points), kMetalKnot), {}, threads);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "memory_limit");
    EXPECT_NE(refused.error().message.find("/steps/0/points/radius"), std::string::npos);
  }
}

TEST(MeshlessBake, ARadiusBeyondTheSceneStillGivesLight) {
  Threads threads;
  const std::string points = R"(,"solver":"meshless","points":{"levels":1,"radius":1e9})";
  const auto coarse = bake(finished("column", recipe_of(points), kMetalKnot), {}, threads);
  ASSERT_TRUE(coarse);
  EXPECT_LT(report_of(*coarse)["certificate"]["relrmse"], 0.5);
}

TEST(MeshlessBake, OldRecipesKeepTheirIdentity) {
  const std::string plain = recipe_identity(*parse_recipe(recipe_of("")));
  EXPECT_EQ(recipe_identity(*parse_recipe(recipe_of(R"(,"solver":"vertices")"))), plain);
  EXPECT_EQ(plain.find("solver"), std::string::npos);
  EXPECT_NE(recipe_identity(*parse_recipe(recipe_of(kMeshless))), plain);
}

}  // namespace
}  // namespace kiln
