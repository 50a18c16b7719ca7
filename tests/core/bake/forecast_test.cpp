// What a plan says beforehand against what the bake then does. Seconds and memory are for kiln_forecast to measure:
// they are the machine's, and the process's.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::input_of;
using testing::report_of;

constexpr double kGoal = 1.5;  // the factor that the plan aims at

json plan_of(const std::string& scene, const std::string& recipe, int count = 0) {
  Threads threads(count);
  return json::parse(*plan_json(input_of(scene, recipe), threads));
}

void expect_within(double predicted, double measured, double factor, const std::string& what) {
  EXPECT_LE(predicted, factor * measured) << what;
  EXPECT_GE(predicted * factor, measured) << what;
}

class Forecast : public ::testing::TestWithParam<const char*> {};

TEST_P(Forecast, CountsAreThoseOfTheBake) {
  const std::string recipe = R"({"environment":{"builtin":"clear"},"quality":"draft"})";
  const json predicted = plan_of(GetParam(), recipe)["prediction"];
  Threads threads;
  const json report = report_of(*bake(input_of(GetParam(), recipe), {}, threads));
  EXPECT_EQ(report["prediction"]["rays"], predicted["rays"]);
  expect_within(predicted["triangles"], report["result"]["triangles"], kGoal, "triangles");
  expect_within(predicted["vertices"], report["result"]["vertices"], 1.15, "vertices");  // Euler's count, seams apart
  expect_within(predicted["rays"], report["rays"], kGoal, "rays");
  expect_within(predicted["artifact_bytes"], report["result"]["bytes"], kGoal, "bytes");
}

INSTANTIATE_TEST_SUITE_P(Demo, Forecast, ::testing::Values("column", "room"));

TEST(ForecastOf, AMeshThatIsNotSplitHasTheVerticesItHas) {
  const json plan = plan_of("column", R"({"steps":[{"do":"prt","subdivide":"off"}]})");
  Threads threads;
  const json report =
      report_of(*bake(input_of("column", R"({"steps":[{"do":"prt","subdivide":"off"}]})"), {}, threads));
  EXPECT_EQ(plan["prediction"]["vertices"], report["result"]["vertices"]);
  EXPECT_EQ(plan["prediction"]["triangles"], report["result"]["triangles"]);
}

TEST(ForecastOf, AllButSecondsRepeatsForAnyNumberOfThreads) {
  json one = plan_of("room", "{}", 1), two = plan_of("room", "{}", 2);
  EXPECT_GT(one["prediction"]["seconds"].get<double>(), 0);
  one["prediction"].erase("seconds");
  two["prediction"].erase("seconds");
  EXPECT_EQ(one, two);
}

TEST(ForecastOf, APromiseSaysWhatItsFigureIsFor) {
  const json budget = plan_of("room", R"({"quality":{"time_budget_s":30}})");
  EXPECT_EQ(budget["prediction"]["of"], "the time budget");
  EXPECT_EQ(budget["prediction"]["seconds"], 30);
  EXPECT_EQ(plan_of("room", "{}")["prediction"]["of"], "the bake");
}

TEST(ForecastOf, ATargetIsToldPassByPass) {
  const std::string recipe = R"({"steps":[{"do":"prt","order":4}],"quality":{"target_error":0.04}})";
  Threads threads;
  const json plan = plan_of("column", recipe)["prediction"];
  const json report = report_of(*bake(input_of("column", recipe), {}, threads));
  EXPECT_EQ(plan["of"], "the promise");
  EXPECT_EQ(plan["ended_by"], report["promise"]["ended_by"]);
  ASSERT_GT(report["promise"]["passes"].size(), 1);
  EXPECT_EQ(plan["passes"], report["promise"]["passes"].size());
  expect_within(plan["triangles"], report["result"]["triangles"], kGoal, "triangles");
  expect_within(plan["rays"], report["rays"], kGoal, "rays");
}

TEST(ForecastOf, AFloorIsSeenBeforehand) {
  const json plan = plan_of("column", R"({"steps":[{"do":"prt","order":4,"subdivide":"off"}],
                                          "quality":{"target_error":0.01}})")["prediction"];
  EXPECT_EQ(plan["ended_by"], "floor");
  EXPECT_NE(plan["reason"].get<std::string>().find("/steps/0/subdivide"), std::string::npos) << plan["reason"];
}

}  // namespace
}  // namespace kiln
