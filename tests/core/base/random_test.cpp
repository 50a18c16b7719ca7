#include "core/base/random.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

namespace kiln {
namespace {

TEST(Random, MixIsTheFinaliserOfSplitmix) {
  // First outputs of splitmix64 seeded with 0, as its authors print them.
  EXPECT_EQ(mix64(0), 0xe220a8397b1dcdafULL);
  EXPECT_EQ(mix64(0x9e3779b97f4a7c15ULL), 0x6e789e6aa1b965f4ULL);
}

TEST(Random, StreamIsAFunctionOfSeedItemAndSample) {
  Random a(1, 2, 3), b(1, 2, 3);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(a.next(), b.next());
  std::set<std::uint64_t> first;
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    for (std::uint64_t item = 0; item < 10; ++item)
      for (std::uint64_t sample = 0; sample < 10; ++sample) first.insert(Random(seed, item, sample).next());
  EXPECT_EQ(first.size(), 1000U);
}

TEST(Random, UniformNumbersHaveMeanAndVarianceOfTheUnitInterval) {
  Random random(7, 0);
  double sum = 0, squares = 0;
  constexpr int kCount = 1 << 18;
  for (int i = 0; i < kCount; ++i) {
    const double x = i % 2 == 0 ? random.uniform_double() : double{random.uniform()};
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    sum += x, squares += x * x;
  }
  // Standard errors: sqrt(1/12) / 512 = .00056 and sqrt(4/45) / 512 = .00058.
  EXPECT_NEAR(sum / kCount, 0.5, 4 * 0.00056);
  EXPECT_NEAR(squares / kCount, 1.0 / 3, 4 * 0.00058);
}

TEST(Random, NeighbouringStreamsAreUncorrelated) {
  double product = 0;
  constexpr int kCount = 1 << 16;
  for (std::uint64_t i = 0; i < kCount; ++i)
    product += (Random(0, i).uniform_double() - 0.5) * (Random(0, i + 1).uniform_double() - 0.5);
  EXPECT_NEAR(product / kCount, 0, 4 * (1.0 / 12) / 256);  // standard error 1/12 / sqrt(count)
}

TEST(Random, EveryInputBitFlipsHalfOfTheOutputBits) {
  double flipped = 0;
  constexpr int kTrials = 200;
  for (std::uint64_t i = 0; i < kTrials; ++i)
    for (int bit = 0; bit < 64; ++bit) flipped += std::popcount(mix64(i) ^ mix64(i ^ (1ULL << bit)));
  EXPECT_NEAR(flipped / (kTrials * 64), 32, 4 * 4 / std::sqrt(kTrials * 64.0));  // binomial: sigma 4 of 64 bits
}

}  // namespace
}  // namespace kiln
