// What the plan skips must not change the result by more than its share: each skip against the forced full computation.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::input_of;
using testing::report_of;

std::string recipe_of(const std::string& step) {
  return R"({"environment":{"builtin":"clear"},"steps":[{"do":"prt","order":4)" + step + "}]}";
}

json baked(const BakeInput& input) {
  Threads threads;
  const auto output = bake(input, {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  return report_of(*output);
}

json baked(const std::string& scene, const std::string& step) { return baked(input_of(scene, recipe_of(step))); }

json baked_octahedron(const std::string& step) {
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 24\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nelement face 8\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  std::string faces;
  for (int i = 0; i < 8; ++i) {  // each its own corners: flat
    const int x = i & 1 ? -1 : 1, y = i & 2 ? -1 : 1, z = i & 4 ? -1 : 1;
    const auto row = [&](int a, int b, int c) {
      std::string out;
      for (const int value : {a, b, c, x, y, z}) out += std::to_string(value) + " ";
      return out + "\n";
    };
    ply += x * y * z > 0 ? row(x, 0, 0) + row(0, y, 0) + row(0, 0, z) : row(0, y, 0) + row(x, 0, 0) + row(0, 0, z);
    faces += "3";
    for (int k = 0; k < 3; ++k) faces += " " + std::to_string(3 * i + k);
    faces += "\n";
  }
  ply += faces;
  BakeInput input;
  input.scene.name = "octahedron.ply";
  input.scene.main = Bytes(ply.begin(), ply.end());
  input.recipe = *parse_recipe(recipe_of(step));
  return baked(input);
}

double error_of(const json& report) { return report["certificate"]["relrmse"].get<double>(); }
double rays_of(const json& report, const std::string& stage) {
  for (const json& s : report["stages"])
    if (s["name"] == stage) return s["rays"].get<double>();
  return 0;
}

TEST(Skip, PointsThatStopEarlyAgainstAllRays) {
  const json some = baked("column", R"(,"subdivide":{"triangles":8000})");
  const json all = baked("column", R"(,"samples":1024,"subdivide":{"triangles":8000})");
  EXPECT_GT(some["parameters"]["noise"].get<double>(), 0);
  EXPECT_EQ(all["parameters"]["noise"], 0);
  EXPECT_LT(rays_of(some, "transfer"), 0.97 * rays_of(all, "transfer"));  // .93 where vertices crowd in the penumbra
  // Meshes differ where the measure does; the added noise is at most the plan's share, and the interval's half width
  // says how far two draws of points lie apart.
  const double wide = all["certificate"]["interval"][1].get<double>() - all["certificate"]["interval"][0].get<double>();
  EXPECT_LT(error_of(some), error_of(all) + some["parameters"]["noise"].get<double>() + wide);
}

TEST(Skip, BouncesThatThePlanLeavesOutAgainstMany) {
  const json few = baked("column", R"(,"samples":256,"subdivide":"off")");
  const json many = baked("column", R"(,"samples":256,"bounces":24,"subdivide":"off")");
  EXPECT_LT(few["parameters"]["bounces"].get<int>(), 24);
  // The certificate's truth has them all. Its points lie where the light of each result changes: two draws.
  const double wide =
      many["certificate"]["interval"][1].get<double>() - many["certificate"]["interval"][0].get<double>();
  EXPECT_LT(error_of(few), error_of(many) + few["error_sources"]["bounce_tail"].get<double>() + wide);
}

/// A convex thing has neither occlusion nor reflections: no ray is traced, not even where bounces are forced.
TEST(Skip, AllRaysOfAConvexThing) {
  const json none = baked_octahedron(""), many = baked_octahedron(R"(,"bounces":3,"samples":256)");
  EXPECT_EQ(none["parameters"]["bounces"], 0);
  EXPECT_EQ(many["parameters"]["bounces"], 3);
  for (const json& report : {none, many}) {
    EXPECT_EQ(rays_of(report, "transfer") + rays_of(report, "bounces"), 0);
    EXPECT_LT(error_of(report), 0.006);  // standard stores to .5 % in components and .1 % of rounding
  }
}

}  // namespace
}  // namespace kiln
