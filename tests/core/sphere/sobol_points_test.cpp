#include "core/sphere/sobol_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "core/sphere/sampling.h"

namespace kiln {
namespace {

int cell(float x, int cells) { return static_cast<int>(x * static_cast<float>(cells)); }

TEST(SobolPoints, EveryPrefixIsStratified) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const SobolPoints points(seed);
    for (int k = 0; k <= 10; ++k) {
      std::set<int> third;
      for (std::uint32_t i = 0; i < 1U << k; ++i) third.insert(cell(points[i].z, 1 << k));
      EXPECT_EQ(third.size(), std::size_t{1} << k) << "seed " << seed;
      for (int split = 0; split <= k; ++split) {
        std::set<std::pair<int, int>> cells;
        for (std::uint32_t i = 0; i < 1U << k; ++i) {
          const Vec2f p = points.pair(i);
          cells.insert({cell(p.x, 1 << split), cell(p.y, 1 << (k - split))});
        }
        EXPECT_EQ(cells.size(), std::size_t{1} << k) << "seed " << seed << ", 2^" << k << " points, split " << split;
      }
    }
  }
}

TEST(SobolPoints, SeedsAreIndependentAndEachPointUniform) {
  // Means over 4096 seeds: one sigma of a centred number is sqrt(1 / 12 / 4096) = .0045, of a product 1 / 12 / 64 =
  // .0013.
  Vec3d mean, product;
  for (std::uint64_t seed = 0; seed < 4096; ++seed) {
    const Vec3d a = to_double(SobolPoints(seed)[5]) - Vec3d{.5, .5, .5},
                b = to_double(SobolPoints(seed + 1)[5]) - Vec3d{.5, .5, .5};
    mean += a * (1. / 4096);
    product += a * b * (1. / 4096);
  }
  for (const double x : {mean.x, mean.y, mean.z}) EXPECT_NEAR(x, 0, 4 * 0.0045);
  for (const double x : {product.x, product.y, product.z}) EXPECT_NEAR(x, 0, 4 * 0.0013);
}

/// Variance over seeds of the mean of f over the first `count` points.
template <class F>
double variance(int count, F&& f) {
  constexpr int kSeeds = 400;
  double sum = 0, squares = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    double mean = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) mean += f(seed, i) / count;
    sum += mean / kSeeds, squares += mean * mean / kSeeds;
  }
  return squares - sum * sum;
}

TEST(SobolPoints, TheVarianceIsThatOfOwenScrambling) {
  // Smooth and with an edge; 400 seeds know a variance to 7 %, their ratio to 10 %: three sigmas.
  const auto smooth = [](const Vec2f& p) { return std::exp(double{p.x}) * std::sin(3.0 * p.y); };
  const auto edge = [](const Vec2f& p) { return p.x * p.x + p.y * p.y < 0.7F ? 1.0 : 0.0; };
  const auto ratio = [](int count, const auto& f) {
    return variance(count, [&](std::uint64_t s, std::uint32_t i) { return f(SobolPoints(s).pair(i)); }) /
           variance(count, [&](std::uint64_t s, std::uint32_t i) { return f(sobol_owen(i, s)); });
  };
  for (const int count : {16, 64, 256}) {
    EXPECT_NEAR(ratio(count, smooth), 1, 0.35) << count;
    EXPECT_NEAR(ratio(count, edge), 1, 0.35) << count;
  }
}

}  // namespace
}  // namespace kiln
