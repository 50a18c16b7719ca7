// Rotation R = Z(alpha) Y(beta) Z(gamma), with Y(beta) = J Z(-beta) J where J swaps the y and z axes
// (Pinchon and Hoggan 2007). Z turns pairs (m, -m); J is a constant symmetric matrix, three quarters of it zero.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/expects.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr int kMax = sh_count(kMaxShOrder);

/// The non-zero entries of J, row by row.
struct SwapMatrix {
  struct Entry {
    float value;
    std::int32_t column;
  };
  std::vector<Entry> entries;
  std::array<std::int32_t, kMax + 1> row_end{};  // row i is entries[row_end[i] .. row_end[i + 1])

  SwapMatrix() {
    const std::vector<double> dense = integrate();
    for (int row = 0; row < kMax; ++row) {
      for (int column = 0; column < kMax; ++column) {
        const double value = dense[static_cast<std::size_t>(row * kMax + column)];
        // Non-zero entries of the bands up to 9 are above 1e-3; the quadrature leaves 1e-15 of the others.
        if (std::abs(value) > 1e-9) entries.push_back({static_cast<float>(value), column});
      }
      row_end[static_cast<std::size_t>(row) + 1] = static_cast<std::int32_t>(entries.size());
    }
  }

  /// J(i, k) = integral of Y_i(x, y, z) Y_k(x, z, y), exact by quadrature.
  static std::vector<double> integrate() {
    std::vector<double> dense(static_cast<std::size_t>(kMax) * kMax);
    std::array<double, kMax> straight, swapped;
    for (const SphereNode& node : sphere_quadrature(2 * (kMaxShOrder - 1))) {
      const Vec3d& w = node.direction;
      evaluate_sh(kMaxShOrder, w, straight.data());
      evaluate_sh(kMaxShOrder, Vec3d{w.x, w.z, w.y}, swapped.data());
      for (std::size_t i = 0; i < kMax; ++i)
        for (std::size_t k = 0; k < kMax; ++k) dense[i * kMax + k] += node.weight * straight[i] * swapped[k];
    }
    return dense;
  }
};

const SwapMatrix& swap_matrix() {
  static const SwapMatrix matrix;
  return matrix;
}

void swap_y_z(int order, const float* in, float* out) {
  const SwapMatrix& matrix = swap_matrix();
  const SwapMatrix::Entry* entry = matrix.entries.data();
  for (int row = 0; row < sh_count(order); ++row) {
    const SwapMatrix::Entry* end = matrix.entries.data() + matrix.row_end[static_cast<std::size_t>(row) + 1];
    float sum = 0;
    for (; entry != end; ++entry) sum += entry->value * in[entry->column];
    out[row] = sum;
  }
}

struct Turn {
  double cosine = 1, sine = 0;
};

/// The turn towards (x, y); none when there is no direction.
Turn turn_towards(double x, double y) {
  const double norm = std::sqrt(x * x + y * y);
  return norm > 0 ? Turn{x / norm, y / norm} : Turn{};
}

void turn_about_z(int order, const Turn& turn, float* c) {
  double cosine = 1, sine = 0;  // of m times the angle
  for (int m = 1; m < order; ++m) {
    const double next = cosine * turn.cosine - sine * turn.sine;
    sine = sine * turn.cosine + cosine * turn.sine;
    cosine = next;
    const auto cm = static_cast<float>(cosine), sm = static_cast<float>(sine);
    for (int l = m; l < order; ++l) {
      float& plus = c[l * (l + 1) + m];
      float& minus = c[l * (l + 1) - m];
      const float p = plus, q = minus;
      plus = p * cm - q * sm;
      minus = p * sm + q * cm;
    }
  }
}

}  // namespace

void rotate_sh(int order, const Basis<float>& basis, const float* in, float* out) {
  EXPECTS(order >= 1 && order <= kMaxShOrder);
  const Vec3d x = to_double(basis.x), z = to_double(basis.z);
  const Turn alpha = turn_towards(z.x, z.y);
  const double sin_beta = z.x * alpha.cosine + z.y * alpha.sine;
  const Turn beta = turn_towards(z.z, sin_beta);
  // gamma is what is left of the x axis once alpha and beta are undone: no division by a small sin(beta).
  const double along = x.x * alpha.cosine + x.y * alpha.sine;
  const Turn gamma = turn_towards(beta.cosine * along - beta.sine * x.z, x.y * alpha.cosine - x.x * alpha.sine);

  std::array<float, kMax> a, b;
  std::copy(in, in + sh_count(order), a.begin());
  turn_about_z(order, gamma, a.data());
  swap_y_z(order, a.data(), b.data());
  turn_about_z(order, {beta.cosine, -beta.sine}, b.data());
  swap_y_z(order, b.data(), out);
  turn_about_z(order, alpha, out);
}

}  // namespace kiln
