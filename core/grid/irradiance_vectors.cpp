#include "core/grid/irradiance_vectors.h"

#include <algorithm>

namespace kiln {
namespace {

Vec3f positive(const Vec3f& x) { return {std::max(0.0F, x.x), std::max(0.0F, x.y), std::max(0.0F, x.z)}; }

}  // namespace

IrradianceVectors OctantSums::vectors(float scale) const {
  IrradianceVectors out;
  for (std::size_t octant = 0; octant < 8; ++octant) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      auto& half = out.vector[2 * axis + (octant >> axis & 1U)];
      for (std::size_t c = 0; c < 3; ++c) half[c] += sums_[octant][c] * scale;
    }
  }
  return out;
}

std::array<Vec3f, kExactParts> exact_parts(const IrradianceVectors& v) {
  std::array<Vec3f, kExactParts> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    std::array<Vec3f, 3> d;
    for (std::size_t axis = 0; axis < 3; ++axis) d[axis] = v.vector[2 * axis][c] - v.vector[2 * axis + 1][c];
    const Vec3f phi = v.vector[0][c] + v.vector[1][c];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out[axis][c] = phi[axis];
      out[3 + axis][c] = d[axis][axis];
    }
    out[6][c] = d[0].y + d[1].x;
    out[7][c] = d[0].z + d[2].x;
    out[8][c] = d[1].z + d[2].y;
  }
  return out;
}

std::array<float, kExactParts> exact_weights(const Vec3f& n) {
  return {n.x / 2,       n.y / 2,       n.z / 2,       n.x * n.x / 2, n.y * n.y / 2,
          n.z * n.z / 2, n.x * n.y / 4, n.x * n.z / 4, n.y * n.z / 4};
}

std::array<Vec3f, kPaperParts> paper_parts(const IrradianceVectors& v) {
  std::array<Vec3f, kPaperParts> out{};
  for (std::size_t d = 0; d < kDirections; ++d) {
    const auto& [r, g, b] = v.vector[d];
    out[2 * d] = {length(r), length(g), length(b)};
    out[2 * d + 1] = normalized(r + g + b, Vec3f{});
  }
  return out;
}

Vec3f exact_irradiance(const std::array<Vec3f, kExactParts>& parts, const Vec3f& n) {
  const std::array<float, kExactParts> weights = exact_weights(n);
  Vec3f sum;
  for (std::size_t k = 0; k < kExactParts; ++k) sum += parts[k] * weights[k];
  return positive(sum);
}

Vec3f paper_irradiance(const IrradianceVectors& v, const Vec3f& n) {
  Vec3f sum;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& [r, g, b] = v.vector[direction_on(axis, n)];
    sum += Vec3f{dot(r, n), dot(g, n), dot(b, n)} * (n[axis] * n[axis]);
  }
  return positive(sum);
}

Vec3f texel_irradiance(const std::array<Vec3f, kPaperParts>& parts, const Vec3f& n) {
  Vec3f sum;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t d = direction_on(axis, n);
    const Vec3f direction = normalized(parts[2 * d + 1], Vec3f{});  // of unit vectors that were interpolated
    sum += parts[2 * d] * (n[axis] * n[axis] * std::max(0.0F, dot(direction, n)));
  }
  return positive(sum);
}

}  // namespace kiln
