#include "core/sphere/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

namespace kiln {
namespace {

TEST(Sampling, EveryPrefixOfTheSequenceIsStratifiedInAllElementaryIntervals) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (int k = 0; k <= 8; ++k) {
      for (int split = 0; split <= k; ++split) {
        std::set<std::pair<int, int>> cells;
        for (std::uint32_t i = 0; i < 1U << k; ++i) {
          const Vec2f p = sobol_owen(i, seed);
          cells.insert({static_cast<int>(p.x * static_cast<float>(1 << split)),
                        static_cast<int>(p.y * static_cast<float>(1 << (k - split)))});
        }
        EXPECT_EQ(cells.size(), std::size_t{1} << k) << "seed " << seed << ", 2^" << k << " points, split " << split;
      }
    }
  }
}

TEST(Sampling, SeedsGiveIndependentScramblings) {
  // The mean over many seeds of a product of two seeds' centred numbers vanishes: 1/12 / sqrt(4096) = .0013 is one
  // sigma.
  double correlation = 0;
  for (std::uint64_t seed = 0; seed < 4096; ++seed)
    correlation += (sobol_owen(5, seed).x - 0.5) * (sobol_owen(5, seed + 1).x - 0.5);
  EXPECT_NEAR(correlation / 4096, 0, 4 * 0.0013);
}

TEST(Sampling, CosineHemisphereHasTheMomentsOfItsDensity) {
  // E[z] = 2/3, E[z^2] = 1/2, E[x^2] = 1/4; a (0,2)-sequence of 2^16 points errs by less than 1e-4.
  constexpr std::uint32_t kCount = 1U << 16;
  double z = 0, zz = 0, xx = 0, x = 0;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Vec3f w = cosine_hemisphere(sobol_owen(i, 7));
    EXPECT_NEAR(length(w), 1, 1e-6);
    x += w.x, z += w.z, zz += w.z * w.z, xx += w.x * w.x;
  }
  EXPECT_NEAR(x / kCount, 0, 1e-4);
  EXPECT_NEAR(z / kCount, 2.0 / 3, 1e-4);
  EXPECT_NEAR(zz / kCount, 0.5, 1e-4);
  EXPECT_NEAR(xx / kCount, 0.25, 1e-4);
}

TEST(Sampling, DiskMapKeepsAreas) {
  // The square of side 1/2 around the centre becomes the disk of radius 1/2: a quarter of either area.
  EXPECT_NEAR(disk_from_square({0.75, 0.5}).x, 0.5, 1e-15);
  EXPECT_NEAR(disk_from_square({0.5, 0.25}).y, -0.5, 1e-15);
  EXPECT_EQ(disk_from_square({0.5, 0.5}).x, 0);
  const auto corner = disk_from_square({1, 1});
  EXPECT_NEAR(std::hypot(corner.x, corner.y), 1, 1e-15);
}

TEST(Sampling, TriangleMapIsUniform) {
  // Means of both barycentrics are 1/3, of their product 1/12.
  double b1 = 0, b2 = 0, product = 0;
  constexpr std::uint32_t kCount = 1U << 14;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Vec2f u = sobol_owen(i, 3);
    const auto b = uniform_triangle({u.x, u.y});
    b1 += b.x, b2 += b.y, product += b.x * b.y;
    EXPECT_LE(b.x + b.y, 1 + 1e-12);
  }
  EXPECT_NEAR(b1 / kCount, 1.0 / 3, 1e-4);
  EXPECT_NEAR(b2 / kCount, 1.0 / 3, 1e-4);
  EXPECT_NEAR(product / kCount, 1.0 / 12, 1e-4);
}

TEST(Sampling, SphereMapIsUniform) {
  Vec3d mean;
  double zz = 0;
  constexpr std::uint32_t kCount = 1U << 14;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Vec2f u = sobol_owen(i, 11);
    const Vec3d w = uniform_sphere({u.x, u.y});
    mean += w, zz += w.z * w.z;
  }
  EXPECT_NEAR(length(mean) / kCount, 0, 1e-4);
  EXPECT_NEAR(zz / kCount, 1.0 / 3, 1e-4);
}

}  // namespace
}  // namespace kiln
