#pragma once
// The nearest place on a triangle, for very many points.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/vec.h"

namespace kiln {

/// The largest whole number that is not above x. (Without SSE 4.1 std::floor is a call.)
inline std::int64_t floor_of(double x) {
  const auto whole = static_cast<std::int64_t>(x);
  return whole - (x < static_cast<double>(whole) ? 1 : 0);
}

/// A triangle ready for distances.
struct FlatTriangle {
  Vec3d a, e1, e2, normal;
  double distance = 0;               // of its plane from the origin
  double g11 = 0, g12 = 0, g22 = 0;  // products of the edges
  Vec3d center;                      // of a ball around it
  double radius = 0;

  FlatTriangle() = default;
  FlatTriangle(const Vec3d& first, const Vec3d& second, const Vec3d& third)
      : a(first), e1(second - first), e2(third - first), normal(normalized(cross(e1, e2), Vec3d{})) {
    distance = dot(normal, a);
    g11 = dot(e1, e1), g12 = dot(e1, e2), g22 = dot(e2, e2);
    center = a + (e1 + e2) / 3.0;
    radius = std::sqrt(std::max(
        {dot(a - center, a - center), dot(second - center, second - center), dot(third - center, third - center)}));
  }
  double area() const { return 0.5 * std::sqrt(std::max(0.0, g11 * g22 - g12 * g12)); }
  /// Whether no place of it is nearer to p than `reach`.
  bool is_beyond(const Vec3d& p, double reach) const {
    const Vec3d d = p - center;
    const double far = radius + reach;
    return dot(d, d) > far * far;
  }
};

/// a + u e1 + v e2, and the square of its distance.
struct NearPlace {
  double u = 0, v = 0, squared = HUGE_VAL;
};

/// By the regions of the plane from which a corner, an edge or the inside is nearest.
inline NearPlace nearest_place(const FlatTriangle& f, const Vec3d& p) {
  const Vec3d d = p - f.a;
  const auto at = [&](double u, double v) {
    const Vec3d offset = d - f.e1 * u - f.e2 * v;
    return NearPlace{u, v, dot(offset, offset)};
  };
  // d seen along both edges, from each of the corners
  const double a1 = dot(d, f.e1), a2 = dot(d, f.e2);
  if (a1 <= 0 && a2 <= 0) return at(0, 0);
  const double b1 = a1 - f.g11, b2 = a2 - f.g12;
  if (b1 >= 0 && b2 <= b1) return at(1, 0);
  const double c1 = a1 - f.g12, c2 = a2 - f.g22;
  if (c2 >= 0 && c1 <= c2) return at(0, 1);
  // the areas opposite to the corners, signed
  const double opposite_c = a1 * b2 - b1 * a2;
  if (opposite_c <= 0 && a1 >= 0 && b1 <= 0 && f.g11 > 0) return at(a1 / f.g11, 0);
  const double opposite_b = c1 * a2 - a1 * c2;
  if (opposite_b <= 0 && a2 >= 0 && c2 <= 0 && f.g22 > 0) return at(0, a2 / f.g22);
  const double opposite_a = b1 * c2 - c1 * b2, along = b2 - b1, back = c1 - c2;
  if (opposite_a <= 0 && along >= 0 && back >= 0 && along + back > 0) {
    const double t = along / (along + back);
    return at(1 - t, t);
  }
  const double all = opposite_a + opposite_b + opposite_c;
  return all > 0 ? at(opposite_b / all, opposite_c / all) : at(0, 0);
}

}  // namespace kiln
