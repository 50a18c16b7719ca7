// Quantisation of coefficients at the extremes of their range, beside each other in one file.
// (One magnitude for all slots, constants, and tiny variation on large ones: tests/core/artifact/round_trip_test.cpp.)
#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/round_trip.h"

namespace kiln::test {
namespace {

TEST(Compression, EverySlotKeepsItsPrecisionBesideOthersOfAnySize) {
  // Neighbours of one VEC4 from 1e-12 to 1e12 in turn; slot 0 carries the vertex's number.
  BakedScene written = random_baked({.order = 4, .fixed = true});
  const std::size_t slots = written.transfer.stride();
  const auto magnitude = [](std::size_t slot) { return std::pow(10.0, static_cast<double>(slot * 7 % 25) - 12); };
  for (std::size_t v = 0; v < written.transfer.vertices(); ++v) {
    for (std::size_t s = 1; s < slots; ++s) {
      float& x = written.transfer.coefficients[v * slots + s];
      x = static_cast<float>(x * magnitude(s));
    }
  }
  for (const int bits : {12, 16, 20}) {  // slot 0 needs 12
    const BakedScene read = round_trip(written, {.transfer = {.bits = bits}});
    const std::vector<std::uint32_t> original = original_vertices(read);
    for (std::size_t v = 0; v < original.size(); ++v) {
      for (std::size_t s = 1; s < slots; ++s) {
        // Half a step of a range of at most 2, and float rounding of offset and stored value.
        const double bound = magnitude(s) * (1 / (std::exp2(bits) - 1) + 4 * 0x1p-23);
        ASSERT_NEAR(read.transfer.at(v, 0)[s], written.transfer.at(original[v], 0)[s], bound) << s;
      }
    }
  }
}

TEST(Compression, LampsOfAnySizeLeaveTheSkyAsItWas) {
  for (const float lamp : {1e-12F, 1.0F, 1e12F}) {
    BakedScene written = random_baked({.order = 2, .channels = 1, .fixed = true});
    for (std::size_t v = 0; v < written.transfer.vertices(); ++v) {
      written.transfer.coefficients[v * 5 + 4] = lamp * static_cast<float>(v % 5);
    }
    const BakedScene read = round_trip(written);
    const std::vector<std::uint32_t> original = original_vertices(read);
    for (std::size_t v = 0; v < original.size(); ++v) {
      for (std::size_t s = 1; s < 4; ++s) {  // in [-1, 1]: half a step of 2 / 4095, and rounding
        ASSERT_NEAR(read.transfer.at(v, 0)[s], written.transfer.at(original[v], 0)[s], 2.5e-4) << lamp;
      }
      ASSERT_NEAR(read.transfer.at(v, 0)[4], written.transfer.at(original[v], 0)[4], 5e-4 * lamp) << lamp;
    }
  }
}

}  // namespace
}  // namespace kiln::test
