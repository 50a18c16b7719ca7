#include "core/sphere/sobol_points.h"

#include <bit>
#include <span>

#include "core/base/expects.h"
#include "core/base/random.h"

namespace kiln {
namespace {

using Matrix = std::array<std::uint32_t, 16>;  // columns; the first bit is the highest

/// The third dimension: m = 1, 3 and the polynomial x^2 + x + 1.
constexpr Matrix third_dimension() {
  Matrix out{};
  out[0] = 1U << 31, out[1] = 3U << 30;
  for (std::size_t k = 2; k < out.size(); ++k) out[k] = out[k - 1] ^ out[k - 2] ^ (out[k - 2] >> 2);
  return out;
}

/// The second: Pascal's triangle mod 2.
constexpr Matrix second_dimension() {
  Matrix out{};
  out[0] = 1U << 31;
  for (std::size_t k = 1; k < out.size(); ++k) out[k] = out[k - 1] ^ (out[k - 1] >> 1);
  return out;
}

constexpr Matrix kSecond = second_dimension(), kThird = third_dimension();

/// Column k of a random lower triangular matrix with ones on its diagonal.
std::uint32_t random_column(std::size_t k, std::uint64_t bits) {
  const std::uint32_t diagonal = 1U << (31 - k);
  return diagonal | (static_cast<std::uint32_t>(bits) & (diagonal - 1));
}

std::uint32_t product(std::span<const std::uint32_t> scramble, std::uint32_t column) {
  std::uint32_t out = 0;
  for (; column != 0; column &= ~(1U << (31 - std::countl_zero(column))))
    out ^= scramble[static_cast<std::size_t>(std::countl_zero(column))];
  return out;
}

float to_unit(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24F; }

}  // namespace

SobolPoints::SobolPoints(std::uint64_t seed) {
  Random random(seed, 0);
  Matrix second, third;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const std::uint64_t two = random.next();
    columns_[k].x = random_column(k, two);  // the first dimension's own matrix only reverses bits
    second[k] = random_column(k, two >> 32);
    third[k] = random_column(k, random.next());
  }
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    columns_[k].y = product(second, kSecond[k]);
    columns_[k].z = product(third, kThird[k]);
  }
  const std::uint64_t two = random.next();
  shift_ = {static_cast<std::uint32_t>(two), static_cast<std::uint32_t>(two >> 32),
            static_cast<std::uint32_t>(random.next())};
}

Vec3f SobolPoints::operator[](std::uint32_t index) const {
  EXPECTS(index < kMost);
  Bits sum = shift_;
  for (; index != 0; index &= index - 1) {
    const Bits& column = columns_[static_cast<std::size_t>(std::countr_zero(index))];
    sum.x ^= column.x, sum.y ^= column.y, sum.z ^= column.z;
  }
  return {to_unit(sum.x), to_unit(sum.y), to_unit(sum.z)};
}

}  // namespace kiln
