#pragma once
// Real, orthonormal spherical harmonics without the Condon-Shortley phase.
//
//   Y(0,0) = 0.282095, Y(1,-1) = 0.488603 y, Y(1,0) = 0.488603 z, Y(1,1) = 0.488603 x;  index i = l(l+1)+m.
//   "Order n" means bands 0..n-1: n*n coefficients.

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

inline constexpr int kMaxShOrder = 10;
constexpr int sh_count(int order) { return order * order; }

/// Writes the order*order values Y_i(w). `w` is unit.
void evaluate_sh(int order, const Vec3f& w, float* out);
void evaluate_sh(int order, const Vec3d& w, double* out);

/// Turns coefficients given in the local frame `basis` into world axes:
/// if f_world(w) = f_local(basis.to_local(w)) then world = rotate(local). Exact within rounding for any order.
/// Cost about 0.3 us at order 6.  `in` and `out` hold order*order values and may be the same array.
void rotate_sh(int order, const Basis<float>& basis, const float* in, float* out);
void rotate_sh(int order, const Basis<double>& basis, const double* in, double* out);

/// Turns functions given in world axes into a frame whose z axis is `n` (unit); where its x axis points is not said.
/// Coefficient i of function k is c[i * columns + k]. Half the cost of rotate_sh, and less with many columns.
void turn_sh_upright(int order, const Vec3d& n, std::size_t columns, double* c);

/// The transfer vector of an unoccluded white Lambertian point with normal n: 1/pi times the clamped cosine,
///   t_lm = A_l / pi * Y_lm(n),   A_l of Ramamoorthi and Hanrahan 2001.   t(n) . L(constant 1) = 1.
void clamped_cosine_transfer(int order, const Vec3f& n, float* out);

/// Takes ringing out of a projection: band l is scaled by 1 / (1 + lambda l^2 (l+1)^2) (Sloan 2008, "Stupid SH
/// tricks"). lambda 0 changes nothing; the mean (band 0) never changes.
void window_sh(int order, float lambda, float* coefficients);

}  // namespace kiln
