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

TEST(ErrorStats, OfRmsIsRelativeToTheLightWhereItIs) {
  // Light at one point of a hundred, a tenth too bright there: a tenth of its root mean square, and of its mean ten
  // times that. What is scaled by three has the same error.
  std::vector<Vec3d> reference(200), values(200);
  reference[7] = {1, 1, 1}, values[7] = {1.1, 1.1, 1.1};
  reference[107] = {3, 3, 3}, values[107] = {3.3, 3.3, 3.3};
  EXPECT_NEAR(compute_error({values, reference, {}, 100}).relrmse, 1.0, 1e-12);
  const ErrorStats of_rms = compute_error({values, reference, {}, 100, {}, true});
  EXPECT_NEAR(of_rms.relrmse, 0.1, 1e-12);
  EXPECT_NEAR(of_rms.by_lighting[1], 0.1, 1e-12);
  EXPECT_NEAR(of_rms.bias, 0.01, 1e-12);
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

TEST(ErrorStats, APointOfWeightTwoIsThatPointTwice) {
  // 200 points of two lightings, a third of them twice; sums in another order: double rounding.
  Random random(3, 0);
  std::vector<Vec3d> values(400), reference(400), values_twice, reference_twice;
  for (std::size_t i = 0; i < 400; ++i) {
    reference[i] = Vec3d{1, 2, 3} * (0.5 + random.uniform_double());
    values[i] = reference[i] + gaussian3(random, 0.1);
  }
  std::vector<double> weights(200, 1.0);
  for (std::size_t i = 0; i < 200; i += 3) weights[i] = 2;
  for (std::size_t i = 0; i < 400; ++i) {
    for (int times = 0; times < static_cast<int>(weights[i % 200]); ++times) {
      values_twice.push_back(values[i]);
      reference_twice.push_back(reference[i]);
    }
  }
  const ErrorStats weighted = compute_error({values, reference, {}, 200, weights});
  const ErrorStats twice = compute_error({values_twice, reference_twice, {}, values_twice.size() / 2});
  EXPECT_NEAR(weighted.relrmse, twice.relrmse, 1e-12);
  EXPECT_NEAR(weighted.bias, twice.bias, 1e-12);
  EXPECT_NEAR(weighted.by_lighting[1], twice.by_lighting[1], 1e-12);
  EXPECT_NEAR(weighted.p99, twice.p99, 1e-12);
  EXPECT_NEAR(weighted.max, twice.max, 1e-12);
}

/// A thousandth of the surface is wrong by all of its light: relRMSE .0316. A hundred points a draw.
TEST(ErrorStats, PointsDrawnWhereErrorsAreGiveTheSameFigureWithLessSpread) {
  const auto spread = [](double share_drawn) {
    double sum = 0, squares = 0;
    constexpr int kDraws = 200, kPoints = 400;
    for (std::uint64_t draw = 0; draw < kDraws; ++draw) {
      Random random(7, draw);
      std::vector<Vec3d> values, reference(kPoints, Vec3d{1, 1, 1});
      std::vector<double> weights;
      for (int i = 0; i < kPoints; ++i) {
        const bool bad = random.uniform_double() < share_drawn;
        values.push_back(bad ? Vec3d{2, 2, 2} : Vec3d{1, 1, 1});
        weights.push_back(bad ? 1e-3 / share_drawn : (1 - 1e-3) / (1 - share_drawn));
      }
      const double found =
          std::pow(compute_error({values, reference, {}, kPoints, weights}, {.resamples = 1}).relrmse, 2);
      sum += found / kDraws;
      squares += found * found / kDraws;
    }
    return std::pair{sum, std::sqrt(squares - sum * sum)};
  };
  const auto [even, even_spread] = spread(1e-3);
  const auto [aimed, aimed_spread] = spread(0.3);
  EXPECT_NEAR(even, 1e-3, 4 * even_spread / std::sqrt(200.0));    // four standard errors of 200 draws
  EXPECT_NEAR(aimed, 1e-3, 4 * aimed_spread / std::sqrt(200.0));  // the same
  EXPECT_LT(aimed_spread, 0.1 * even_spread);                     // by theory .05: sqrt(.7 / .3) / sqrt(1e3)
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
