#include "core/artifact/evaluate.h"

#include <algorithm>

#include "core/base/expects.h"

namespace kiln {
namespace {

/// Equation 1 with `start` for the lamps.
Vec3f add_light(const Transfer& transfer, std::size_t vertex, std::span<const Vec3f> light, Vec3d start) {
  EXPECTS(vertex < transfer.vertices());
  EXPECTS(light.empty() || light.size() == static_cast<std::size_t>(sh_count(transfer.order)));
  for (std::size_t c = 0; c < 3; ++c) {
    const float* t = transfer.at(vertex, static_cast<int>(c));
    for (std::size_t i = 0; i < light.size(); ++i) start[c] += static_cast<double>(t[i]) * light[i][c];
  }
  return to_float(start);
}

Vec3d lamps_at(const Transfer& transfer, std::size_t vertex) {
  if (!transfer.fixed || vertex >= transfer.vertices()) return {};
  const int slot = transfer.slots() - 1;
  return {transfer.at(vertex, 0)[slot], transfer.at(vertex, 1)[slot], transfer.at(vertex, 2)[slot]};
}

/// What a function of vertices is inside a triangle.
template <class F>
Vec3f interpolate(const TrianglePoint& point, const F& at) {
  const auto& [a, b, c] = point.triangle;
  return at(a) * (1 - point.u - point.v) + at(b) * point.u + at(c) * point.v;
}

}  // namespace

Vec3f value_at(const Transfer& transfer, std::size_t vertex, std::span<const Vec3f> light) {
  return add_light(transfer, vertex, light, lamps_at(transfer, vertex));
}

std::vector<Vec3f> values_of(const Transfer& transfer, std::span<const Vec3f> light) {
  std::vector<Vec3f> out(transfer.vertices());
  for (std::size_t v = 0; v < out.size(); ++v) out[v] = value_at(transfer, v, light);
  return out;
}

Vec3f shown_at(const Transfer& transfer, std::size_t vertex, const LightParts& light) {
  const Vec3f all = value_at(transfer, vertex, light.all);
  if (light.bright.empty()) return all;
  const Vec3f bright = add_light(transfer, vertex, light.bright, {});
  Vec3f out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = std::max(0.0F, all[c] - bright[c]) + std::max(0.0F, bright[c]);
  return out;
}

std::vector<Vec3f> shown_values(const Transfer& transfer, const LightParts& light) {
  std::vector<Vec3f> out(transfer.vertices());
  for (std::size_t v = 0; v < out.size(); ++v) out[v] = shown_at(transfer, v, light);
  return out;
}

Vec3f shown_at(const Transfer& transfer, const TrianglePoint& point, const LightParts& light) {
  return interpolate(point, [&](std::size_t vertex) { return shown_at(transfer, vertex, light); });
}

Vec3f value_at(const Transfer& transfer, const TrianglePoint& point, std::span<const Vec3f> light) {
  return interpolate(point, [&](std::size_t vertex) { return value_at(transfer, vertex, light); });
}

Vec3f distant_value_at(const Transfer& transfer, const TrianglePoint& point, std::span<const Vec3f> light) {
  return interpolate(point, [&](std::size_t vertex) { return add_light(transfer, vertex, light, {}); });
}

}  // namespace kiln
