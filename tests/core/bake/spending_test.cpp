#include "core/bake/spending.h"

#include <gtest/gtest.h>

namespace kiln {
namespace {

constexpr std::uint64_t kManyRays = 1'000'000'000'000;
constexpr double kMostPaths = 4096.0 * Spending::kFewestPoints;

ErrorStats pilot(double error, double noise) {
  ErrorStats out;
  out.relrmse = error, out.noise = noise;
  return out;
}

TEST(Spending, AQuietReferenceLooksAtMorePoints) {
  const Spending loud = plan_spending(pilot(0.1, 2), 1, kManyRays, true);
  const Spending quiet = plan_spending(pilot(0.1, 0.5), 1, kManyRays, true);
  EXPECT_GT(quiet.points, loud.points);
  EXPECT_LT(quiet.samples, loud.samples);
}

TEST(Spending, WhatNoPointTakesGoesIntoPaths) {
  for (const double error : {1.0, 0.1, 0.01, 1e-4}) {
    const Spending s = plan_spending(pilot(error, 0.01), 1, kManyRays, true);
    EXPECT_LE(s.points, Spending::kMostPoints);
    const double paths = static_cast<double>(s.points) * s.samples;
    EXPECT_LE(paths, kMostPaths);
    EXPECT_GT(paths, 0.99 * kMostPaths) << error;  // both are whole numbers
  }
}

}  // namespace
}  // namespace kiln
