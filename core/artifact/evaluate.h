#pragma once
// Relighting on the CPU, word for word what core/artifact/README.md tells a reader to do.
//   value_c(v) = sum_i light[i][c] * t[c][i] + (fixed ? t[c][n*n] : 0)                                  (1)
// Units   radiance that leaves a white Lambertian point, W m^-2 sr^-1.   An empty light is darkness.

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/mesh/mesh.h"
#include "core/prt/transfer.h"

namespace kiln {

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

/// What distant light alone does there: equation 1 without the lamps' slot, which may be large enough to round it away.
Vec3f distant_value_at(const Transfer&, const TrianglePoint&, std::span<const Vec3f> light);

}  // namespace kiln
