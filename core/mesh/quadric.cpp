#include "core/mesh/quadric.h"

namespace kiln {

Vec3d least_point(const Quadric& q, const Vec3d& anchor, double eps) {
  const double shift = eps * q.trace();
  if (!(shift > 0)) return anchor;
  // (A + shift I) d = -(A anchor + b), by Cramer's rule
  const Vec3d r = -(q.times(anchor) + q.b);
  const Vec3d x{q.xx + shift, q.xy, q.xz}, y{q.xy, q.yy + shift, q.yz}, z{q.xz, q.yz, q.zz + shift};
  const double det = dot(x, cross(y, z));
  const Vec3d d{dot(r, cross(y, z)) / det, dot(x, cross(r, z)) / det, dot(x, cross(y, r)) / det};
  return is_finite(d) ? anchor + d : anchor;
}

}  // namespace kiln
