#pragma once
// Figure 3(b) of [Krivanek04]: cuts a triangle so that no split edge is left on it, recursively.

#include <array>
#include <cstdint>

#include "core/mesh/mesh.h"

namespace kiln {

/// Ops answers split(a, b), middle(a, b) and position(a) for the ids in `t`, and takes emit(triangle).
template <class Ops>
void close_triangle(const Triangle& t, Ops& ops) {
  std::array<bool, 3> cut{};
  int cuts = 0;
  for (std::size_t k = 0; k < 3; ++k) cuts += (cut[k] = ops.split(t[k], t[(k + 1) % 3])) ? 1 : 0;
  if (cuts == 0) return ops.emit(t);

  // Turn the triangle: with one cut it lies on ab, with two on ab and bc.
  std::size_t first = 0;
  while (!cut[first] || (cuts == 2 && !cut[(first + 1) % 3])) ++first;
  const std::uint32_t a = t[first], b = t[(first + 1) % 3], c = t[(first + 2) % 3];
  const std::uint32_t ab = ops.middle(a, b);
  const auto next = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) { close_triangle(Triangle{i, j, k}, ops); };

  if (cuts == 1) {
    next(a, ab, c);
    next(ab, b, c);
    return;
  }
  const std::uint32_t bc = ops.middle(b, c);
  next(ab, b, bc);
  if (cuts == 3) {
    const std::uint32_t ca = ops.middle(c, a);
    next(a, ab, ca);
    next(bc, c, ca);
    next(ab, bc, ca);
    return;
  }
  // The rest is the quadrilateral a, ab, bc, c: take its shorter diagonal.
  const Vec3f one = ops.position(bc) - ops.position(a), other = ops.position(c) - ops.position(ab);
  if (dot(one, one) <= dot(other, other)) {
    next(a, ab, bc);
    next(a, bc, c);
  } else {
    next(a, ab, c);
    next(ab, bc, c);
  }
}

}  // namespace kiln
