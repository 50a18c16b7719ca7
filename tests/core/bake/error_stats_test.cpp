#include "core/bake/error_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.h"

namespace kiln {
namespace {

/// A standard normal deviate (Box and Muller 1958).
double gaussian(Random& random) {
  const double radius = std::sqrt(-2 * std::log(1 - random.uniform_double()));
  return radius * std::cos(2 * std::numbers::pi * random.uniform_double());
}

Vec3d gaussian3(Random& random, double sigma) {
  const double x = gaussian(random), y = gaussian(random), z = gaussian(random);
  return Vec3d{x, y, z} * sigma;
}

TEST(ErrorStats, EqualValuesHaveNoError) {
  const std::vector<Vec3d> values{{1, 2, 3}, {0, 0.5, 1}};
  const ErrorStats stats = compute_error({values, values, {}, 2});
  EXPECT_EQ(stats.relrmse, 0);
  EXPECT_EQ(stats.interval_low, 0);
  EXPECT_EQ(stats.interval_high, 0);
  EXPECT_EQ(stats.max, 0);
  EXPECT_EQ(stats.bias, 0);
}

TEST(ErrorStats, AConstantOffsetIsItsShareOfTheMean) {
  // ref 1 and 3 (mean 2), x is 0.1 above: relRMSE = bias = max = 0.1 / 2. Tolerances are double rounding.
  const std::vector<Vec3d> reference{{1, 1, 1}, {3, 3, 3}}, values{{1.1, 1.1, 1.1}, {3.1, 3.1, 3.1}};
  const ErrorStats stats = compute_error({values, reference, {}, 2});
  EXPECT_NEAR(stats.relrmse, 0.05, 1e-12);
  EXPECT_NEAR(stats.bias, 0.05, 1e-12);
  EXPECT_NEAR(stats.max, 0.05, 1e-12);
  EXPECT_NEAR(stats.p99, 0.05, 1e-12);
}

TEST(ErrorStats, NoLightingDominates) {
  // The same relative error of 10 % under a light of 1 and one of a million; and 0 under a third.
  const std::vector<Vec3d> reference{{1, 1, 1}, {1, 1, 1}, {1e6, 1e6, 1e6}, {1e6, 1e6, 1e6}, {5, 5, 5}, {5, 5, 5}};
  std::vector<Vec3d> values = reference;
  for (std::size_t i = 0; i < 4; ++i) values[i] *= 1.1;
  const ErrorStats stats = compute_error({values, reference, {}, 2});
  EXPECT_EQ(stats.lightings, 3);
  EXPECT_NEAR(stats.by_lighting[0], 0.1, 1e-12);
  EXPECT_NEAR(stats.by_lighting[1], 0.1, 1e-12);
  EXPECT_NEAR(stats.by_lighting[2], 0, 1e-12);
  EXPECT_NEAR(stats.relrmse, 0.1 * std::sqrt(2.0 / 3), 1e-12);
}

TEST(ErrorStats, TheNoiseOfTheReferenceIsSubtracted) {
  // x = 1 + 0.03 g, ref = 1 + 0.1 g'; g, g' normal. The truth is 0.03, though |x - ref| shows 0.104.
  std::vector<Vec3d> values, half_a, half_b, reference;
  for (std::uint64_t i = 0; i < 40000; ++i) {
    Random random(3, i);
    values.push_back(Vec3d{1, 1, 1} + gaussian3(random, 0.03));
    half_a.push_back(Vec3d{1, 1, 1} + gaussian3(random, 0.1 * std::sqrt(2.0)));
    half_b.push_back(Vec3d{1, 1, 1} + gaussian3(random, 0.1 * std::sqrt(2.0)));
    reference.push_back((half_a.back() + half_b.back()) * 0.5);
  }
  const std::vector<Vec3d> noise = noise_from_halves(half_a, half_b);
  const ErrorStats stats = compute_error({values, reference, noise, values.size()});
  // Spread of relRMSE^2: each of 120000 terms has sd sqrt(2 (0.0109^2 + 0.01^2)) = 0.021: 6e-5, that is 0.001 at 0.03.
  EXPECT_NEAR(stats.relrmse, 0.03, 0.004);
  EXPECT_NEAR(stats.noise, 0.1, 0.001);
  EXPECT_GT(compute_error({values, reference, {}, values.size()}).relrmse, 0.1);
}

TEST(ErrorStats, TheIntervalHoldsTheTruthAboutNineteenTimesInTwenty) {
  // Errors with a heavy tail (a normal times the exponential of one), as creases make them: truth is sqrt(E e^2) =
  // 0.02 exp(0.5^2) with sigma 0.5 for the exponent.
  const double truth = 0.02 * std::exp(0.25);
  int held = 0;
  const int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<Vec3d> values, reference;
    for (std::uint64_t i = 0; i < 300; ++i) {
      Random random(static_cast<std::uint64_t>(trial) + 10, i);
      const double e = 0.02 * gaussian(random) * std::exp(0.5 * gaussian(random));
      reference.push_back({1, 1, 1});
      values.push_back({1 + e, 1 + e, 1 + e});
    }
    const ErrorStats stats =
        compute_error({values, reference, {}, values.size()}, {static_cast<std::uint64_t>(trial), 400});
    if (stats.interval_low <= truth && truth <= stats.interval_high) ++held;
  }
  // Binomial sd of 300 trials at 0.95 is 0.0126; bootstrap intervals of skewed data are known to fall a few % short.
  EXPECT_GE(held, static_cast<int>(0.88 * trials));
  EXPECT_LT(held, trials);
}

TEST(ErrorStats, IsQuotedWithoutTheWorstHundredth) {
  std::vector<Vec3d> reference(200, {1, 1, 1}), values(200, {1.01, 1.01, 1.01});
  values[17] = {5, 5, 5};
  values[18] = {4, 4, 4};
  const ErrorStats stats = compute_error({values, reference, {}, 200});
  EXPECT_NEAR(stats.relrmse_without_worst_1pct, 0.01, 1e-12);
  EXPECT_NEAR(stats.max, 4, 1e-12);
  EXPECT_GT(stats.relrmse, 0.3);
}

TEST(ErrorStats, ASceneLitByNothingHasErrorZeroAndSaysSo) {
  const std::vector<Vec3d> black(10, {0, 0, 0});
  const ErrorStats stats = compute_error({black, black, {}, 10});
  EXPECT_EQ(stats.relrmse, 0);
  EXPECT_EQ(stats.dark_lightings, 1);
}

TEST(ErrorStats, LightWhereTheReferenceHasNoneIsNeverANumberBelowOne) {
  const std::vector<Vec3d> black(10, {0, 0, 0}), grey(10, {0.001, 0.001, 0.001});
  const ErrorStats stats = compute_error({grey, black, {}, 10});
  EXPECT_NEAR(stats.relrmse, 1, 1e-12);
  EXPECT_EQ(stats.dark_lightings, 0);
}

TEST(ErrorStats, EqualSeedsGiveEqualBits) {
  std::vector<Vec3d> values, reference;
  for (std::uint64_t i = 0; i < 500; ++i) {
    Random random(7, i);
    reference.push_back({1, 1, 1});
    values.push_back(Vec3d{1, 1, 1} + gaussian3(random, 0.1));
  }
  const ErrorInput in{values, reference, {}, values.size()};
  EXPECT_EQ(compute_error(in, {5, 200}).interval_low, compute_error(in, {5, 200}).interval_low);
  EXPECT_NE(compute_error(in, {5, 200}).interval_low, compute_error(in, {6, 200}).interval_low);
}

TEST(ErrorStats, OnePointAndNoPointGiveFiniteFigures) {
  const std::vector<Vec3d> one{{2, 2, 2}}, other{{1, 1, 1}};
  const ErrorStats stats = compute_error({one, other, {}, 1});
  EXPECT_NEAR(stats.relrmse, 1, 1e-12);
  EXPECT_NEAR(stats.relrmse_without_worst_1pct, 1, 1e-12);
  EXPECT_EQ(stats.interval_high, stats.relrmse);
  EXPECT_EQ(compute_error({}).points, 0U);
}

}  // namespace
}  // namespace kiln
