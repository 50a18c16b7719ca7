#pragma once
// An affine map in double precision.

#include "core/base/vec.h"

namespace kiln {

/// p -> x p.x + y p.y + z p.z + t.
struct Affine {
  Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, t{0, 0, 0};

  Vec3d vector(const Vec3d& v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3d point(const Vec3d& p) const { return vector(p) + t; }
  double determinant() const { return dot(x, cross(y, z)); }
  friend Affine operator*(const Affine& a, const Affine& b) {
    return {a.vector(b.x), a.vector(b.y), a.vector(b.z), a.point(b.t)};
  }
};

/// The matrix of cofactors, which carries area vectors along: (M a) x (M b) = cofactors(M) (a x b), also when M is
/// singular.
inline Affine cofactors(const Affine& m) { return {cross(m.y, m.z), cross(m.z, m.x), cross(m.x, m.y), {}}; }

inline bool is_finite(const Affine& m) { return is_finite(m.x) && is_finite(m.y) && is_finite(m.z) && is_finite(m.t); }

}  // namespace kiln
