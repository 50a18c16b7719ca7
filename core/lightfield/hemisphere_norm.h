#pragma once
// The distance between radiance functions: integrals over the hemisphere around a normal, in closed form.
//   |f|^2 = 1/(2 pi) integral over n.w > 0 of f(w)^2 dw = |R T(n) c|^2 / (2 pi)                                  (6)
// T(n) turns the harmonics' coefficients upright. In that frame only equal m couple, and bands of equal parity are
// orthogonal on the half-sphere, so R (the triangular factor of their Gram matrix) is sparse and does not depend on n.
// Paper   Vanhoey et al. 2015, eqs. 5 and 6, which calls a closed form tedious and integrates by Lebedev's rule
// Units   of the coefficients; R, G and B are functions of their own, whose squares are summed
// Error   2e-11 relative (measured by its test), also for functions that nearly vanish above the horizon
//         (|f|^2 = 2e-12 |c|^2 at degree 8), where a Gram matrix c G c cancels to nothing. A sum of squares is never
//         below zero.
// Cost    see README.md                Repeat  same bits always.       Fails   never

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/sphere/sh.h"

namespace kiln {

class HemisphereNorm {
 public:
  explicit HemisphereNorm(int degree);

  int degree() const { return degree_; }
  std::size_t count() const { return static_cast<std::size_t>(sh_count(degree_ + 1)); }

  /// Replaces coefficients in world axes by coordinates whose dot products are 1/(2 pi) integral of f g over the
  /// hemisphere of `n` (unit). Coefficient i of function k is c[i * columns + k].
  void to_coordinates(const Vec3d& n, std::size_t columns, double* c) const;

  /// Products 1/(2 pi) integral of f_i . f_k of RGB functions: element i (i + 1) / 2 + k, k <= i, of `products`.
  /// `c` has columns R, G, B of function 0, then of 1, and so on; what it holds afterwards is not said.
  void products(const Vec3d& n, std::size_t functions, std::vector<double>& c, std::vector<float>& products) const;

 private:
  struct Term {
    double factor;
    std::size_t to, from;  // coordinate `to` gets factor times coefficient `from`; `to` ascends
  };
  int degree_;
  std::vector<Term> terms_;
};

/// Squared norm (6) of a function with the `3 count` coefficients of R, then G, then B.
double squared_norm(const HemisphereNorm&, const Vec3d& n, std::span<const double> rgb);

/// Squared distance (5) of two reflected radiance functions on the hemisphere of `n`.
double squared_distance(const HemisphereNorm&, const Vec3d& n, std::span<const float> a, std::span<const float> b);

/// The reference of squared_norm: product Gauss quadrature, exact but for rounding.
double squared_norm_by_quadrature(int degree, const Vec3d& n, std::span<const double> rgb);

}  // namespace kiln
