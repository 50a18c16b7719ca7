#include "core/lightfield/hemisphere_norm.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "core/base/expects.h"
#include "core/sphere/quadrature.h"

namespace kiln {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Bands that couple with azimuth m: those even in z first. They are orthogonal among themselves, the others too.
std::vector<int> bands_of(int degree, int m) {
  std::vector<int> out;
  for (const int parity : {0, 1})
    for (int l = m + parity; l <= degree; l += 2) out.push_back(l);
  return out;
}

/// Columns: Y_lm along the meridian of its crest at Gauss nodes of z in [0, 1], times the square root of the weight, so
/// that dot products are 1/(2 pi) times the integral over the upper hemisphere.
std::vector<std::vector<double>> sampled_bands(int degree, int m, const std::vector<int>& bands) {
  std::vector<std::vector<double>> columns(bands.size());
  std::vector<double> y(static_cast<std::size_t>(sh_count(degree + 1)));
  for (const QuadratureNode& node : gauss_legendre(degree + 1)) {
    const double z = 0.5 * (node.x + 1);
    const double turn = m == 0 ? kTurn : kTurn / 2;  // integral of cos^2(m phi)
    evaluate_sh(degree + 1, Vec3d{std::sqrt(1 - z * z), 0, z}, y.data());
    const double root = std::sqrt(0.5 * node.weight * turn / kTurn);
    for (std::size_t k = 0; k < bands.size(); ++k)
      columns[k].push_back(root * y[static_cast<std::size_t>(bands[k] * (bands[k] + 1) + m)]);
  }
  return columns;
}

double dot_of(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// R of the QR decomposition, r[row][column], by modified Gram-Schmidt done twice. Squaring into a Gram matrix first
/// would lose the weakest functions.
std::vector<std::vector<double>> triangular_factor(std::vector<std::vector<double>> columns) {
  const std::size_t n = columns.size();
  std::vector<std::vector<double>> r(n, std::vector<double>(n));
  for (std::size_t k = 0; k < n; ++k) {
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t row = 0; row < k; ++row) {
        const double along = dot_of(columns[row], columns[k]);
        r[row][k] += along;
        for (std::size_t i = 0; i < columns[k].size(); ++i) columns[k][i] -= along * columns[row][i];
      }
    }
    r[k][k] = std::sqrt(dot_of(columns[k], columns[k]));
    for (double& x : columns[k]) x /= r[k][k];
  }
  return r;
}

void add_rgb(std::span<const double> rgb, std::size_t count, std::vector<double>& columns) {
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < 3; ++c) columns.push_back(rgb[c * count + i]);
}

}  // namespace

HemisphereNorm::HemisphereNorm(int degree) : degree_(degree) {
  EXPECTS(degree >= 0 && degree < kMaxShOrder);
  std::size_t to = 0;
  for (int m = -degree; m <= degree; ++m) {
    const std::vector<int> bands = bands_of(degree, std::abs(m));
    const auto r = triangular_factor(sampled_bands(degree, std::abs(m), bands));
    for (std::size_t row = 0; row < bands.size(); ++row, ++to) {
      for (std::size_t k = row; k < bands.size(); ++k) {
        const bool orthogonal = k > row && (bands[k] - bands[row]) % 2 == 0 && (bands[row] - std::abs(m)) % 2 == 0;
        if (!orthogonal) terms_.push_back({r[row][k], to, static_cast<std::size_t>(bands[k] * (bands[k] + 1) + m)});
      }
    }
  }
}

void HemisphereNorm::to_coordinates(const Vec3d& n, std::size_t columns, double* c) const {
  turn_sh_upright(degree_ + 1, n, columns, c);
  constexpr std::size_t kBlock = 6;
  std::array<double, kBlock* static_cast<std::size_t>(sh_count(kMaxShOrder))> block;
  for (std::size_t first = 0; first < columns; first += kBlock) {
    const std::size_t used = std::min(kBlock, columns - first);
    for (std::size_t i = 0; i < count(); ++i)
      for (std::size_t k = 0; k < kBlock; ++k) block[i * kBlock + k] = k < used ? c[i * columns + first + k] : 0;
    const Term* t = terms_.data();
    for (std::size_t to = 0; to < count(); ++to) {
      std::array<double, kBlock> sum{};
      for (; t != terms_.data() + terms_.size() && t->to == to; ++t)
        for (std::size_t k = 0; k < kBlock; ++k) sum[k] += t->factor * block[t->from * kBlock + k];
      for (std::size_t k = 0; k < used; ++k) c[to * columns + first + k] = sum[k];
    }
  }
}

void HemisphereNorm::products(const Vec3d& n, std::size_t functions, std::vector<double>& c,
                              std::vector<float>& products) const {
  EXPECTS(c.size() == 3 * functions * count());
  to_coordinates(n, 3 * functions, c.data());
  // One function after the other, filled up to whole blocks of four sums that run side by side.
  const std::size_t row = (3 * count() + 3) / 4 * 4;
  std::vector<double> f(functions * row);
  for (std::size_t i = 0; i < count(); ++i)
    for (std::size_t k = 0; k < functions; ++k)
      for (std::size_t channel = 0; channel < 3; ++channel)
        f[k * row + 3 * i + channel] = c[(i * functions + k) * 3 + channel];
  products.clear();
  for (std::size_t i = 0; i < functions; ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      std::array<double, 4> sum{};
      for (std::size_t at = 0; at < row; at += 4)
        for (std::size_t lane = 0; lane < 4; ++lane) sum[lane] += f[i * row + at + lane] * f[k * row + at + lane];
      products.push_back(static_cast<float>((sum[0] + sum[1]) + (sum[2] + sum[3])));
    }
  }
}

double squared_norm(const HemisphereNorm& norm, const Vec3d& n, std::span<const double> rgb) {
  EXPECTS(rgb.size() == 3 * norm.count());
  std::vector<double> columns;
  columns.reserve(rgb.size());
  add_rgb(rgb, norm.count(), columns);
  norm.to_coordinates(n, 3, columns.data());
  return dot_of(columns, columns);
}

double squared_distance(const HemisphereNorm& norm, const Vec3d& n, std::span<const float> a,
                        std::span<const float> b) {
  EXPECTS(a.size() == b.size());
  std::vector<double> difference(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) difference[i] = static_cast<double>(a[i]) - b[i];
  return squared_norm(norm, n, difference);
}

double squared_norm_by_quadrature(int degree, const Vec3d& n, std::span<const double> rgb) {
  const auto count = static_cast<std::size_t>(sh_count(degree + 1));
  EXPECTS(rgb.size() == 3 * count);
  const Basis<double> frame = basis_around(n);
  const int steps = 2 * degree + 1;
  std::vector<double> y(count);
  double sum = 0;
  for (const QuadratureNode& node : gauss_legendre(degree + 1)) {
    const double z = 0.5 * (node.x + 1), radius = std::sqrt(1 - z * z);
    for (int k = 0; k < steps; ++k) {
      const double phi = kTurn * k / steps;
      evaluate_sh(degree + 1, frame.to_world({radius * std::cos(phi), radius * std::sin(phi), z}), y.data());
      for (std::size_t c = 0; c < 3; ++c) {
        double value = 0;
        for (std::size_t i = 0; i < count; ++i) value += y[i] * rgb[c * count + i];
        sum += 0.5 * node.weight / steps * value * value;
      }
    }
  }
  return sum;
}

}  // namespace kiln
