// Rotation R = Z(alpha) Y(beta) Z(gamma), with Y(beta) = J Z(-beta) J where J swaps the y and z axes
// (Pinchon and Hoggan 2007). Z turns pairs (m, -m); J is a constant symmetric matrix, three quarters of it zero.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "core/base/expects.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr int kMax = sh_count(kMaxShOrder);

// Numbers of columns that the compiler knows.
using One = std::integral_constant<std::size_t, 1>;
using Block = std::integral_constant<std::size_t, 6>;  // two functions of R, G and B

/// The non-zero entries of J, row by row.
template <class T>
struct SwapMatrix {
  struct Entry {
    T value;
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
        if (std::abs(value) > 1e-9) entries.push_back({static_cast<T>(value), column});
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

template <class T>
const SwapMatrix<T>& swap_matrix() {
  static const SwapMatrix<T> matrix;
  return matrix;
}

/// Of functions side by side: coefficient i of function k is in[i * columns + k].
template <class T, class Columns>
void swap_y_z(int order, Columns columns, const T* in, T* out) {
  const SwapMatrix<T>& matrix = swap_matrix<T>();
  const auto* entry = matrix.entries.data();
  for (int row = 0; row < sh_count(order); ++row, out += columns) {
    const auto* end = matrix.entries.data() + matrix.row_end[static_cast<std::size_t>(row) + 1];
    std::array<T, Columns{}> sum{};
    for (; entry != end; ++entry) {
      const T* from = in + static_cast<std::size_t>(entry->column) * columns;
      for (std::size_t k = 0; k < columns; ++k) sum[k] += entry->value * from[k];
    }
    std::copy(sum.begin(), sum.end(), out);
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

template <class T, class Columns>
void turn_about_z(int order, const Turn& turn, Columns columns, T* c) {
  double cosine = 1, sine = 0;  // of m times the angle
  for (int m = 1; m < order; ++m) {
    const double next = cosine * turn.cosine - sine * turn.sine;
    sine = sine * turn.cosine + cosine * turn.sine;
    cosine = next;
    const auto cm = static_cast<T>(cosine), sm = static_cast<T>(sine);
    for (int l = m; l < order; ++l) {
      T* plus = c + static_cast<std::size_t>(l * (l + 1) + m) * columns;
      T* minus = c + static_cast<std::size_t>(l * (l + 1) - m) * columns;
      for (std::size_t k = 0; k < columns; ++k) {
        const T p = plus[k], q = minus[k];
        plus[k] = p * cm - q * sm;
        minus[k] = p * sm + q * cm;
      }
    }
  }
}

template <class T>
void rotate(int order, const Basis<T>& basis, const T* in, T* out) {
  EXPECTS(order >= 1 && order <= kMaxShOrder);
  const Vec3d x{basis.x.x, basis.x.y, basis.x.z}, z{basis.z.x, basis.z.y, basis.z.z};
  const Turn alpha = turn_towards(z.x, z.y);
  const double sin_beta = z.x * alpha.cosine + z.y * alpha.sine;
  const Turn beta = turn_towards(z.z, sin_beta);
  // gamma is what is left of the x axis once alpha and beta are undone: no division by a small sin(beta).
  const double along = x.x * alpha.cosine + x.y * alpha.sine;
  const Turn gamma = turn_towards(beta.cosine * along - beta.sine * x.z, x.y * alpha.cosine - x.x * alpha.sine);

  std::array<T, kMax> a, b;
  std::copy(in, in + sh_count(order), a.begin());
  turn_about_z(order, gamma, One{}, a.data());
  swap_y_z(order, One{}, a.data(), b.data());
  turn_about_z(order, {beta.cosine, -beta.sine}, One{}, b.data());
  swap_y_z(order, One{}, b.data(), out);
  turn_about_z(order, alpha, One{}, out);
}

}  // namespace

void rotate_sh(int order, const Basis<float>& basis, const float* in, float* out) { rotate(order, basis, in, out); }
void rotate_sh(int order, const Basis<double>& basis, const double* in, double* out) { rotate(order, basis, in, out); }

void turn_sh_upright(int order, const Vec3d& n, std::size_t columns, double* c) {
  EXPECTS(order >= 1 && order <= kMaxShOrder);
  const Turn alpha = turn_towards(n.x, n.y);
  const Turn beta = turn_towards(n.z, n.x * alpha.cosine + n.y * alpha.sine);
  const auto count = static_cast<std::size_t>(sh_count(order));
  std::array<double, kMax * Block{}> a, b;
  for (std::size_t first = 0; first < columns; first += Block{}) {
    const std::size_t used = std::min<std::size_t>(Block{}, columns - first);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < Block{}; ++k) a[i * Block{} + k] = k < used ? c[i * columns + first + k] : 0;
    turn_about_z(order, {alpha.cosine, -alpha.sine}, Block{}, a.data());
    swap_y_z(order, Block{}, a.data(), b.data());
    turn_about_z(order, beta, Block{}, b.data());
    swap_y_z(order, Block{}, b.data(), a.data());
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < used; ++k) c[i * columns + first + k] = a[i * Block{} + k];
  }
}

}  // namespace kiln
