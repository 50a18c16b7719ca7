#pragma once
// The sum of squared distances of a point from planes and lines, as ten numbers (Garland and Heckbert 1997).

#include <algorithm>
#include <cmath>

#include "core/base/vec.h"

namespace kiln {

/// Of lines along borders, squared lengths beside the areas of planes: borders move less than surfaces.
inline constexpr double kBorderWeight = 4;

/// Q(p) = p A p + 2 b p + c. Planes are weighted by area, lines by squared length: Q is an area times a squared
/// distance.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // A
  Vec3d b;
  double c = 0;

  double trace() const { return xx + yy + zz; }
  Vec3d times(const Vec3d& p) const {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z, xz * p.x + yz * p.y + zz * p.z};
  }
  /// Not below 0, which rounding would allow.
  double at(const Vec3d& p) const { return std::max(0.0, dot(p, times(p)) + 2 * dot(b, p) + c); }

  Quadric& operator+=(const Quadric& o) {
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
    b += o.b;
    c += o.c;
    return *this;
  }
  friend Quadric operator+(Quadric a, const Quadric& b) { return a += b; }

  /// weight * (n p - d)^2
  void add_plane(const Vec3d& n, double d, double weight) {
    xx += weight * n.x * n.x, xy += weight * n.x * n.y, xz += weight * n.x * n.z;
    yy += weight * n.y * n.y, yz += weight * n.y * n.z, zz += weight * n.z * n.z;
    b -= n * (weight * d);
    c += weight * d * d;
  }

  /// weight * |e x p + m|^2: for m = a x b and e = b - a the squared distance from the line through a and b, times
  /// |e|^2.
  void add_line(const Vec3d& e, const Vec3d& m, double weight) {
    const double ee = dot(e, e);
    xx += weight * (ee - e.x * e.x), xy -= weight * e.x * e.y, xz -= weight * e.x * e.z;
    yy += weight * (ee - e.y * e.y), yz -= weight * e.y * e.z, zz += weight * (ee - e.z * e.z);
    b += cross(m, e) * weight;
    c += weight * dot(m, m);
  }
};

/// Where Q is least, drawn towards `anchor` as far as Q does not care: the least of Q(p) + eps trace(A) |p - anchor|^2.
/// `anchor` itself where A is zero.
Vec3d least_point(const Quadric&, const Vec3d& anchor, double eps = 1e-5);

}  // namespace kiln
