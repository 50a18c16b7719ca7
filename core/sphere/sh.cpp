#include "core/sphere/sh.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"

namespace kiln {
namespace {

// Normalised Legendre recurrence, without the powers of sin theta that the azimuth part carries:
//   Q(m,m) = Q(m-1,m-1) sqrt((2m+1)/(2m)),   Q(l,m) = a(l,m) z Q(l-1,m) - b(l,m) Q(l-2,m)
struct Recurrence {
  std::array<double, kMaxShOrder> diagonal{};
  std::array<std::array<double, kMaxShOrder>, kMaxShOrder> a{}, b{};

  Recurrence() {
    diagonal[0] = std::sqrt(1 / (4 * std::numbers::pi));
    for (int m = 0; m < kMaxShOrder; ++m) {
      const auto um = static_cast<std::size_t>(m);
      // Real harmonics of m > 0 carry sqrt(2); the step from 0 to 1 brings it in.
      if (m > 0) diagonal[um] = diagonal[um - 1] * std::sqrt((2.0 * m + 1) / (2.0 * m) * (m == 1 ? 2 : 1));
      for (int l = m + 1; l < kMaxShOrder; ++l) {
        const auto ul = static_cast<std::size_t>(l);
        const double down = (l - 1.0) * (l - 1.0);
        a[um][ul] = std::sqrt((4.0 * l * l - 1) / (1.0 * l * l - 1.0 * m * m));
        b[um][ul] = l == m + 1 ? 0 : a[um][ul] * std::sqrt((down - m * m) / (4 * down - 1));
      }
    }
  }
};

const Recurrence& recurrence() {
  static const Recurrence table;
  return table;
}

template <class T>
void evaluate(int order, const Vec3<T>& w, T* out) {
  EXPECTS(order >= 1 && order <= kMaxShOrder);
  const Recurrence& r = recurrence();
  T cosine = 1, sine = 0;  // of m phi, times sin^m theta
  for (int m = 0; m < order; ++m) {
    const auto um = static_cast<std::size_t>(m);
    T before = 0, now = static_cast<T>(r.diagonal[um]);
    for (int l = m; l < order; ++l) {
      if (l > m) {
        const auto ul = static_cast<std::size_t>(l);
        const T next = static_cast<T>(r.a[um][ul]) * w.z * now - static_cast<T>(r.b[um][ul]) * before;
        before = now;
        now = next;
      }
      out[l * (l + 1) - m] = now * sine;
      out[l * (l + 1) + m] = now * cosine;
    }
    const T turned = cosine * w.x - sine * w.y;
    sine = cosine * w.y + sine * w.x;
    cosine = turned;
  }
}

/// A_l / pi: 1, 2/3, 1/4, 0, -1/24, ... (Ramamoorthi and Hanrahan 2001, eq. 8).
double clamped_cosine_band(int l) {
  if (l == 1) return 2.0 / 3;
  if (l % 2 == 1) return 0;
  double central = 1;  // l! / (2^l (l/2)!^2)
  for (int k = 1; k <= l / 2; ++k) central *= (2.0 * k - 1) / (2.0 * k);
  return (l / 2 % 2 == 0 ? -2 : 2) * central / ((l + 2.0) * (l - 1.0));
}

}  // namespace

void evaluate_sh(int order, const Vec3f& w, float* out) { evaluate(order, w, out); }
void evaluate_sh(int order, const Vec3d& w, double* out) { evaluate(order, w, out); }

void clamped_cosine_transfer(int order, const Vec3f& n, float* out) {
  evaluate(order, n, out);
  for (int l = 0; l < order; ++l) {
    const auto band = static_cast<float>(clamped_cosine_band(l));
    for (int i = l * l; i < (l + 1) * (l + 1); ++i) out[i] *= band;
  }
}

void window_sh(int order, float lambda, float* coefficients) {
  EXPECTS(order >= 1 && order <= kMaxShOrder && lambda >= 0);
  for (int l = 1; l < order; ++l) {
    const auto laplacian = static_cast<float>(l * (l + 1));
    const float factor = 1 / (1 + lambda * laplacian * laplacian);
    for (int i = l * l; i < (l + 1) * (l + 1); ++i) coefficients[i] *= factor;
  }
}

}  // namespace kiln
