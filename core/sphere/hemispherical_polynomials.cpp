#include "core/sphere/hemispherical_polynomials.h"

#include <array>
#include <vector>

#include "core/base/expects.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr std::size_t kHarmonics = sh_count(kMaxPolynomialDegree + 1);
constexpr std::size_t kPolynomials = polynomial_count(kMaxPolynomialDegree);

/// projection[i * kPolynomials + k] = integral of Y_i P_k over the sphere. A polynomial of degree d needs no higher
/// band than d, so that smaller degrees use the first rows and columns.
const std::vector<double>& projection() {
  static const std::vector<double> table = [] {
    std::vector<double> out(kHarmonics * kPolynomials);
    std::array<double, kHarmonics> y;
    std::array<double, kPolynomials> p;
    for (const SphereNode& node : sphere_quadrature(2 * kMaxPolynomialDegree)) {
      evaluate_sh(kMaxPolynomialDegree + 1, node.direction, y.data());
      evaluate_polynomials(kMaxPolynomialDegree, node.direction, p.data());
      for (std::size_t i = 0; i < kHarmonics; ++i)
        for (std::size_t k = 0; k < kPolynomials; ++k) out[i * kPolynomials + k] += node.weight * y[i] * p[k];
    }
    return out;
  }();
  return table;
}

}  // namespace

void evaluate_polynomials(int degree, const Vec3d& w, double* out) {
  EXPECTS(degree >= 0 && degree <= kMaxPolynomialDegree);
  out[0] = 1;
  for (int k = 1; k <= degree; ++k) {
    const double* below = out + (k - 1) * k / 2;
    double* row = out + k * (k + 1) / 2;
    for (int j = 0; j < k; ++j) row[j] = w.x * below[j];
    row[k] = w.y * below[k - 1];
  }
}

void reflect_polynomials(int degree, double* coefficients) {
  EXPECTS(degree >= 0 && degree <= kMaxPolynomialDegree);
  for (int k = 1; k <= degree; k += 2)
    for (int i = k * (k + 1) / 2; i < (k + 1) * (k + 2) / 2; ++i) coefficients[i] = -coefficients[i];
}

void polynomials_to_sh(int degree, const double* coefficients, double* out) {
  EXPECTS(degree >= 0 && degree <= kMaxPolynomialDegree);
  const double* row = projection().data();
  for (int i = 0; i < sh_count(degree + 1); ++i, row += kPolynomials) {
    out[i] = 0;
    for (int k = 0; k < polynomial_count(degree); ++k) out[i] += row[k] * coefficients[k];
  }
}

}  // namespace kiln
