#pragma once
// The nearest place on a triangle, for very many points.

#include <algorithm>
#include <cmath>

#include "core/base/vec.h"

namespace kiln {

/// A triangle ready for distances.
struct FlatTriangle {
  Vec3d a, e1, e2, normal;
  double distance = 0;                        // of its plane from the origin
  double g11 = 0, g12 = 0, g22 = 0, det = 0;  // of the edges

  FlatTriangle() = default;
  FlatTriangle(const Vec3d& first, const Vec3d& second, const Vec3d& third)
      : a(first), e1(second - first), e2(third - first), normal(normalized(cross(e1, e2), Vec3d{})) {
    distance = dot(normal, a);
    g11 = dot(e1, e1), g12 = dot(e1, e2), g22 = dot(e2, e2);
    det = g11 * g22 - g12 * g12;
  }
  double area() const { return 0.5 * std::sqrt(std::max(0.0, det)); }
};

/// a + u e1 + v e2, and the square of its distance.
struct NearPlace {
  double u = 0, v = 0, squared = HUGE_VAL;
};

/// By regions of the plane: inside, or on the best of the edges. A triangle without area is its edges.
inline NearPlace nearest_place(const FlatTriangle& f, const Vec3d& p) {
  const Vec3d d = p - f.a;
  const auto at = [&](double u, double v) {
    const Vec3d offset = d - f.e1 * u - f.e2 * v;
    return NearPlace{u, v, dot(offset, offset)};
  };
  const auto along = [](double x, double size) { return size > 0 ? std::clamp(x / size, 0.0, 1.0) : 0.0; };
  const double d1 = dot(d, f.e1), d2 = dot(d, f.e2);
  if (f.det > 0) {
    const double u = (d1 * f.g22 - d2 * f.g12) / f.det, v = (d2 * f.g11 - d1 * f.g12) / f.det;
    if (u >= 0 && v >= 0 && u + v <= 1) return at(u, v);
  }
  const double t = along((d2 - d1) - (f.g12 - f.g11), f.g11 - 2 * f.g12 + f.g22);  // along the edge opposite to a
  NearPlace best = at(along(d1, f.g11), 0);
  for (const NearPlace& other : {at(0, along(d2, f.g22)), at(1 - t, t)}) {
    if (other.squared < best.squared) best = other;
  }
  return best;
}

}  // namespace kiln
