#include "core/sphere/sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/random.h"

namespace kiln {
namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xff00ff00U) >> 8) | ((x & 0x00ff00ffU) << 8);
  x = ((x & 0xf0f0f0f0U) >> 4) | ((x & 0x0f0f0f0fU) << 4);
  x = ((x & 0xccccccccU) >> 2) | ((x & 0x33333333U) << 2);
  return ((x & 0xaaaaaaaaU) >> 1) | ((x & 0x55555555U) << 1);
}

/// Owen scrambling: each bit is flipped by a hash of the bits above it (Laine and Karras 2011; constants of Vegdahl).
std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return reverse_bits(x);
}

/// The second Sobol dimension: direction numbers are the rows of Pascal's triangle mod 2.
std::uint32_t sobol_second(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t direction = 0x80000000U; index != 0; index >>= 1, direction ^= direction >> 1)
    if (index & 1) result ^= direction;
  return result;
}

float to_unit(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24F; }

}  // namespace

Vec2f sobol_owen(std::uint32_t index, std::uint64_t seed) {
  const std::uint64_t first = mix64(seed), second = mix64(first);
  const std::uint32_t shuffled = owen_scramble(index, static_cast<std::uint32_t>(first));
  return {to_unit(owen_scramble(reverse_bits(shuffled), static_cast<std::uint32_t>(first >> 32))),
          to_unit(owen_scramble(sobol_second(shuffled), static_cast<std::uint32_t>(second)))};
}

Vec2<double> disk_from_square(const Vec2<double>& u) {
  const double a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {0, 0};
  constexpr double kQuarter = std::numbers::pi / 4;
  const bool wide = std::abs(a) > std::abs(b);
  const double radius = wide ? a : b;
  const double phi = wide ? kQuarter * (b / a) : 2 * kQuarter - kQuarter * (a / b);
  return {radius * std::cos(phi), radius * std::sin(phi)};
}

Vec3d cosine_hemisphere(const Vec2<double>& u) {
  const Vec2<double> d = disk_from_square(u);
  return {d.x, d.y, std::sqrt(std::max(0.0, 1 - d.x * d.x - d.y * d.y))};
}

Vec3d uniform_sphere(const Vec2<double>& u) {
  const double z = 1 - 2 * u.x, radius = std::sqrt(std::max(0.0, 1 - z * z));
  const double phi = 2 * std::numbers::pi * u.y;
  return {radius * std::cos(phi), radius * std::sin(phi), z};
}

Vec2<double> uniform_triangle(const Vec2<double>& u) {
  const double root = std::sqrt(u.x);
  return {root * (1 - u.y), root * u.y};
}

}  // namespace kiln
