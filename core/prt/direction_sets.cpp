#include "core/prt/direction_sets.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/prt/morton.h"
#include "core/prt/row_sum.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

std::vector<Vec2f> square_points(const std::vector<int>& rounds, std::uint64_t seed) {
  std::vector<Vec2f> points;
  for (const int round : rounds) {
    const auto begin = static_cast<std::ptrdiff_t>(points.size());
    while (points.size() < static_cast<std::size_t>(round) * kPacket)
      points.push_back(sobol_owen(static_cast<std::uint32_t>(points.size()), seed));
    std::sort(points.begin() + begin, points.end(), [](const Vec2f& a, const Vec2f& b) {
      const std::uint32_t ka = morton_code(a), kb = morton_code(b);
      return ka != kb ? ka < kb : a.x < b.x;
    });
  }
  return points;
}

std::vector<int> rounds_of(int packets, int first) {
  std::vector<int> out;
  for (int end = first; end > 0 && end < packets; end *= 2) out.push_back(end);
  out.push_back(packets);
  return out;
}

Vec3f spread_over(Spread spread, const Vec2f& u) {
  if (spread == Spread::cosine) return cosine_hemisphere(u);
  return to_float(uniform_sphere(Vec2<double>{spread == Spread::half_sphere ? 0.5 * u.x : u.x, u.y}));
}

}  // namespace

DirectionSets::DirectionSets(int order, int samples, int sets, std::uint64_t seed, int first, Spread spread)
    : samples_((samples + kPacket - 1) / kPacket * kPacket),
      sets_(sets),
      row_width_((sh_count(order) + 7) / 8 * 8),
      rounds_(rounds_of(samples_ / kPacket, (first + kPacket - 1) / kPacket)) {
  const std::size_t total = index(sets, 0);
  rows_.assign(total * static_cast<std::size_t>(row_width_), 0.0F);
  x_.reserve(total), y_.reserve(total), z_.reserve(total);
  for (int set = 0; set < sets; ++set) {
    for (const Vec2f& u : square_points(rounds_, mix64(seed ^ static_cast<std::uint64_t>(set)))) {
      const Vec3f w = spread_over(spread, u);
      if (order > 0) evaluate_sh(order, w, rows_.data() + x_.size() * static_cast<std::size_t>(row_width_));
      x_.push_back(w.x), y_.push_back(w.y), z_.push_back(w.z);
    }
  }
}

void DirectionSets::turn(int set, int packet, const Basis<float>& basis, Rays16& out) const {
  const std::size_t first = index(set, packet * kPacket);
  const float *x = x_.data() + first, *y = y_.data() + first, *z = z_.data() + first;
  const auto [bx, by, bz] = basis;
  combine16(x, y, z, {bx.x, by.x, bz.x}, out.dx.data());
  combine16(x, y, z, {bx.y, by.y, bz.y}, out.dy.data());
  combine16(x, y, z, {bx.z, by.z, bz.z}, out.dz.data());
}

LocalFrame local_frame(const DirectionSets& sets, const Vec3f& normal, std::uint64_t seed, std::uint64_t item) {
  Random random(seed, item);
  const int set = static_cast<int>(random.next() % static_cast<std::uint64_t>(sets.sets()));
  const float azimuth = 2 * std::numbers::pi_v<float> * random.uniform();
  const Basis<float> plain = basis_around(normal);
  const float c = std::cos(azimuth), s = std::sin(azimuth);
  return {set, {plain.x * c + plain.y * s, plain.y * c - plain.x * s, plain.z}};
}

}  // namespace kiln
