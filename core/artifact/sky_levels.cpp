#include "core/artifact/sky_levels.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

constexpr int kMantissa = 9, kBias = 15, kMostExponent = 31;
constexpr double kLargest = 65408;  // 511 * 2^(31 - 24)

std::uint32_t pack(const Vec3d& c) {
  const double most = std::max({c.x, c.y, c.z});
  int exponent = most > 0 ? std::max(-kBias - 1, std::ilogb(most)) + 1 + kBias : 0;
  const auto mantissa = [&](double x) { return std::lround(x * std::exp2(kMantissa + kBias - exponent)); };
  if (mantissa(most) == 1 << kMantissa) ++exponent;
  exponent = std::clamp(exponent, 0, kMostExponent);
  const auto part = [&](double x) {
    return static_cast<std::uint32_t>(std::clamp(mantissa(std::max(0.0, x)), 0L, (1L << kMantissa) - 1));
  };
  return static_cast<std::uint32_t>(exponent) << 27U | part(c.z) << 18U | part(c.y) << 9U | part(c.x);
}

Vec3d unpack(std::uint32_t word) {
  const double scale = std::exp2(static_cast<int>(word >> 27U) - kBias - kMantissa);
  return Vec3d{double(word & 511U), double(word >> 9U & 511U), double(word >> 18U & 511U)} * scale;
}

}  // namespace

PackedSky pack_sky(const SkyLevels& levels) {
  double most = 0;
  for (const Environment& level : levels)
    for (const Vec3f& c : level.radiance) most = std::max({most, double{c.x}, double{c.y}, double{c.z}});
  PackedSky out{.heights = {}, .unit = most > 0 ? std::exp2(std::ceil(std::log2(most / kLargest))) : 1, .texels = {}};
  for (const Environment& level : levels) {
    out.heights.push_back(level.height);
    for (const Vec3f& c : level.radiance) out.texels.push_back(pack(to_double(c) / out.unit));
  }
  return out;
}

SkyLevels unpack_sky(const PackedSky& packed) {
  SkyLevels out;
  auto texel = packed.texels.begin();
  for (const int height : packed.heights) {
    Environment& level =
        out.emplace_back(Environment{.name = {}, .width = 2 * height, .height = height, .radiance = {}});
    const auto count = 2 * static_cast<std::size_t>(height) * static_cast<std::size_t>(height);
    for (std::size_t i = 0; i < count; ++i) level.radiance.push_back(to_float(unpack(*texel++) * packed.unit));
  }
  return out;
}

}  // namespace kiln
