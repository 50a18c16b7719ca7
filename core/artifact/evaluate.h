#pragma once
// Relighting on the CPU, word for word what core/artifact/README.md tells a reader to do.
//   value_c(v) = sum_i light[i][c] * t[c][i] + (fixed ? t[c][n*n] : 0)                                  (1)
// As shown, light whose bright part is known (core/scene/bright_part.h) is added up part by part, each at least 0:
//   shown_c(v) = max(0, value_c(v) - b_c(v)) + max(0, b_c(v)),   b of the bright part, without the last slot (2)
// Units   radiance that leaves a white Lambertian point, W m^-2 sr^-1.   An empty light is darkness.

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/mesh/mesh.h"
#include "core/prt/transfer.h"

namespace kiln {

struct LightParts {
  std::span<const Vec3f> all, bright = {};  // coefficients; none bright: equation 2 is equation 1
};
/// Equation 2, at a vertex, at every vertex and interpolated.
Vec3f shown_at(const Transfer&, std::size_t vertex, const LightParts&);
std::vector<Vec3f> shown_values(const Transfer&, const LightParts&);

/// Equation 1 at one vertex. `light` is empty or has sh_count(order) elements.
Vec3f value_at(const Transfer&, std::size_t vertex, std::span<const Vec3f> light);

/// Equation 1 at every vertex.
std::vector<Vec3f> values_of(const Transfer&, std::span<const Vec3f> light);

/// The value inside a triangle as a viewer interpolates it: (1-u-v), u, v are the weights of its three corners.
struct TrianglePoint {
  Triangle triangle;
  float u = 0, v = 0;
};
Vec3f value_at(const Transfer&, const TrianglePoint&, std::span<const Vec3f> light);
Vec3f shown_at(const Transfer&, const TrianglePoint&, const LightParts&);

/// What distant light alone does there: equation 1 without the lamps' slot, which may be large enough to round it away.
Vec3f distant_value_at(const Transfer&, const TrianglePoint&, std::span<const Vec3f> light);

}  // namespace kiln
