// Storing weights of components must change no more than its share of the error, and must be worth it.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::input_of;
using testing::report_of;

json report_with(const std::string& encoding) {
  Threads threads;
  const auto output =
      bake(input_of("column",
                    R"({"environment":{"builtin":"clear"},"quality":"draft","steps":[{"do":"prt")" + encoding + "}]}"),
           {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  return report_of(*output);
}

double coefficient_bytes(const json& report) {
  for (const json& stream : report["result"]["streams"])
    if (stream["name"] == "coefficients") return stream["bytes"].get<double>();
  return 0;
}

TEST(Compression, StaysWithinItsShareOfTheErrorAgainstTheForcedRawForm) {
  const json raw = report_with(R"(,"encoding":{"form":"raw"})"), fewer = report_with("");
  ASSERT_EQ(raw["result"]["form"], "raw");
  ASSERT_EQ(fewer["result"]["form"], "pca");
  const double share = fewer["parameters"]["compression"].get<double>();
  const json& sources = fewer["error_sources"];
  const double stored = std::hypot(sources["compression"].get<double>(), sources["quantisation"].get<double>());
  // The share is of the mean over all directions of light, the sources of the judged ones, at 256 vertices.
  EXPECT_LT(stored, 1.5 * share);
  EXPECT_EQ(raw["error_sources"]["compression"], 0);
  // Certificates of both ask the same points and paths, so their difference is that of the files: by the triangle
  // inequality at most what storage changes.
  EXPECT_NEAR(fewer["certificate"]["relrmse"].get<double>(), raw["certificate"]["relrmse"].get<double>(), share);
  EXPECT_LT(coefficient_bytes(fewer), coefficient_bytes(raw) / 3);
}

TEST(Compression, ARankThatIsAskedForIsTaken) {
  const json report = report_with(R"(,"encoding":{"form":"pca","rank":3,"bits":8})");
  EXPECT_EQ(report["result"]["rank"], 3);
  EXPECT_GT(report["error_sources"]["compression"].get<double>(), report["parameters"]["compression"].get<double>());
}

TEST(Compression, ARankAboveTheNumberOfSlotsLeavesNothingOut) {
  const json report = report_with(R"(,"order":2,"encoding":{"form":"pca","rank":300})");
  EXPECT_EQ(report["result"]["rank"], 12);
  EXPECT_LT(report["error_sources"]["compression"].get<double>(), 1e-5);  // floats of size 1
}

}  // namespace
}  // namespace kiln
