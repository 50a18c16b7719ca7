#pragma once
// Polynomials of a direction's projection onto the tangent plane: x^i y^j with i + j <= degree, in a local frame whose
// z axis is the normal.
//
// They are the harmonics of bands 0 .. degree that are even in z: both have (degree + 1)(degree + 2) / 2 members and
// span the same functions on the upper hemisphere. So what is a rotation there is one here, by way of harmonics.
// Paper   "polynomials of bi-degree d" of Vanhoey et al. 2015, section 6, after Malzbender et al. 2001
// Shape   x^i y^j, k = i + j, has index k (k + 1) / 2 + j: 1, x, y, x^2, x y, y^2, ...

#include "core/base/vec.h"

namespace kiln {

inline constexpr int kMaxPolynomialDegree = 8;
constexpr int polynomial_count(int degree) { return (degree + 1) * (degree + 2) / 2; }

/// Writes the polynomial_count(degree) values. `w` is in the local frame; its z does not matter.
void evaluate_polynomials(int degree, const Vec3d& w, double* out);

/// The function of -x and -y, which is its reflection about the normal. Exact.
void reflect_polynomials(int degree, double* coefficients);

/// The same function on the upper hemisphere in harmonics of order degree + 1 of the same frame; below the horizon it
/// is the mirror image. `out` holds sh_count(degree + 1) values. Error 1e-14 of the largest coefficient.
void polynomials_to_sh(int degree, const double* coefficients, double* out);

}  // namespace kiln
