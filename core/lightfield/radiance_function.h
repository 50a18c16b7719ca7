#pragma once
// Radiance functions (RF) one at a time, in either basis: what the papers' equations say, at a fixed direction.
//   reflection      L~(w) = L(R_n w),  R_n w = 2 (n.w) n - w                                              (section 3.1)
//   interpolation   L~_t(p, w) = a1 L~1(w) + a2 L~2(w) + a3 L~3(w),   L_t(p, w) = L~_t(p, R_n w)                 (1, 2)
//   gradient        J (J^T J)^-1 [L~2 - L~1; L~3 - L~1],   J = [p2 - p1, p3 - p1]                                   (3)
//   extrapolation   L~_t(p, w) = L~1(w) + gradient . (p - p1)                                                       (4)
// Harmonics in world axes make all of it linear in the coefficients: simplify.h works on those. Hemispherical
// polynomials live in the frame of their own normal, so that only values at a direction can be combined; on their
// hemisphere they are harmonics too (to_harmonics), and get distances from there.
// Paper   Vanhoey et al. 2015, sections 3 and 7.   Units  W m^-2 sr^-1; w points away from the surface, unit
// Shape   coefficients of R, then G, then B, radiance_count(basis, degree) each

#include <array>
#include <cstddef>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

enum class RadianceBasis {
  harmonics,    // bands 0 .. degree in world axes: (degree + 1)^2 coefficients
  polynomials,  // x^i y^j, i + j <= degree, in basis_around(normal): (degree + 1)(degree + 2) / 2 coefficients
};

std::size_t radiance_count(RadianceBasis, int degree);

/// An RF, or its reflection; both have the same form.
struct RadianceFunction {
  RadianceBasis basis = RadianceBasis::harmonics;
  int degree = 4;
  Vec3d normal{0, 0, 1};  // unit
  std::vector<double> coefficients;
};

/// Value of R, G, B. A direction below the horizon sees what the horizon under the same azimuth shows (section 7);
/// straight below, where there is none, it is the x axis of basis_around(normal).
Vec3d evaluate(const RadianceFunction&, const Vec3d& w);
Vec3d at_or_above_horizon(const Vec3d& normal, const Vec3d& w);

Vec3d reflect_direction(const Vec3d& normal, const Vec3d& w);

/// RF to r-RF and back, of one channel in harmonics of world axes.
void reflect_harmonics(int degree, const Vec3d& normal, double* coefficients);

/// RF to r-RF and back. Exact for polynomials, within rounding for harmonics.
RadianceFunction reflected(const RadianceFunction&);

/// The same function on its hemisphere, in harmonics of the same degree in world axes.
RadianceFunction to_harmonics(const RadianceFunction&);

/// A triangle with r-RFs at its corners.
struct RadianceTriangle {
  std::array<Vec3d, 3> position;
  std::array<RadianceFunction, 3> reflected;
};

Vec3d interpolate_reflected(const RadianceTriangle&, const Vec3d& barycentrics, const Vec3d& w);             // (1)
Vec3d interpolate(const RadianceTriangle&, const Vec3d& barycentrics, const Vec3d& normal, const Vec3d& w);  // (2)
std::array<Vec3d, 3> gradient(const RadianceTriangle&, const Vec3d& w);  // of R, G and B                  (3)
Vec3d extrapolate_reflected(const RadianceTriangle&, const Vec3d& p, const Vec3d& w);  // (4)

/// Extrapolation (4) as weights of the corners, which sum to 1: the barycentrics of the foot of `p` on the plane. Where
/// the triangle has no area the first corner alone counts: its gradient is taken as zero.
Vec3d foot_barycentrics(const std::array<Vec3d, 3>& triangle, const Vec3d& p);

}  // namespace kiln
