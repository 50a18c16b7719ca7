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

json baked(const std::string& scene, const std::string& step,
           const std::string& environment = R"({"builtin":"clear"})") {
  Threads threads;
  const auto output =
      bake(input_of(scene, R"({"environment":)" + environment + R"(,"steps":[{"do":"prt","order":4)" + step + "}]}"),
           {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  return report_of(*output);
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

}  // namespace
}  // namespace kiln
