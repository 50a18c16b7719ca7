// Projection of the bilinear map on SH, in closed form along u and by Gauss quadrature along v.
//
// On one parallel every Y_i is a trigonometric polynomial of degree < order in the longitude phi, and the map is a
// periodic piecewise linear function. The integral of hat functions of width d against e^{im phi} is
//   d * sinc^2(m d / 2) * e^{im phi_i}   with sinc(x) = sin(x) / x,                                             (1)
// so a row of the map enters by its moments (1) alone. Across parallels the integrand is smooth between two rows.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/scene/environment.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMaxWaves = 2 * kMaxShOrder - 1;  // 1, cos phi, sin phi, cos 2 phi, ...

using Waves = std::array<Vec3d, kMaxWaves>;  // wave 2m-1 is cos(m phi), 2m is sin(m phi)

/// Moments (1) of each row. Cost width * height * (2 order - 1).
std::vector<Waves> row_moments(const Environment& e, int order) {
  const auto width = static_cast<std::size_t>(e.width);
  const double d = 2 * kPi / e.width;
  std::vector<Waves> rows(static_cast<std::size_t>(e.height));
  for (std::size_t i = 0; i < width; ++i) {
    const double phi = 2 * kPi * ((static_cast<double>(i) + 0.5) / e.width - 0.5);
    std::array<double, kMaxWaves> wave{};
    wave[0] = d;
    for (int m = 1; m < order; ++m) {
      const double x = m * d / 2, sinc = std::sin(x) / x;
      wave[static_cast<std::size_t>(2 * m - 1)] = d * sinc * sinc * std::cos(m * phi);
      wave[static_cast<std::size_t>(2 * m)] = d * sinc * sinc * std::sin(m * phi);
    }
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const Vec3d radiance = to_double(e.radiance[j * width + i]);
      for (std::size_t k = 0; k < static_cast<std::size_t>(2 * order - 1); ++k) rows[j][k] += radiance * wave[k];
    }
  }
  return rows;
}

/// Adds weight * integral over phi of row(phi) * Y(theta, phi): the Y by a discrete Fourier transform, exact for their
/// degree.
void add_parallel(const Waves& row, double theta, double rotation, double weight, int order, std::vector<Vec3d>& sum) {
  const int samples = 2 * order - 1;
  std::array<double, kMaxShOrder * kMaxShOrder> y{};
  for (int k = 0; k < samples; ++k) {
    const double phi = 2 * kPi * k / samples;
    // Turning about +Y from +Z towards +X lowers the longitude.
    const double turned = phi - rotation;
    const Vec3d w{std::sin(theta) * std::cos(turned), std::cos(theta), std::sin(theta) * std::sin(turned)};
    evaluate_sh(order, w, y.data());
    Vec3d value = row[0];
    for (int m = 1; m < order; ++m) {
      value += (row[static_cast<std::size_t>(2 * m - 1)] * std::cos(m * phi) +
                row[static_cast<std::size_t>(2 * m)] * std::sin(m * phi)) *
               2.0;
    }
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += value * (weight * y[i] / samples);
  }
}

struct Node {
  double x, weight;  // on [0, 1]
};
constexpr std::array<Node, 4> kGauss4{{{0.5 - 0.4305681557970263, 0.1739274225687269},
                                       {0.5 - 0.1699905217924281, 0.3260725774312731},
                                       {0.5 + 0.1699905217924281, 0.3260725774312731},
                                       {0.5 + 0.4305681557970263, 0.1739274225687269}}};

}  // namespace

std::vector<Vec3f> project_environment(const Environment& e, int order) {
  EXPECTS(order >= 1 && order <= kMaxShOrder);
  EXPECTS(e.radiance.size() == static_cast<std::size_t>(e.width) * static_cast<std::size_t>(e.height));
  const std::vector<Waves> rows = row_moments(e, order);
  const double rotation = e.rotation_deg * kPi / 180;
  std::vector<Vec3d> sum(static_cast<std::size_t>(sh_count(order)));
  // Intervals between row centres, the two half intervals at the poles among them, in steps of at most pi / 64.
  const double row_height = kPi / e.height;
  for (int j = -1; j < e.height; ++j) {
    const double from = std::max(0.0, (j + 0.5) * row_height), to = std::min(kPi, (j + 1.5) * row_height);
    const int steps = static_cast<int>(std::ceil((to - from) / (kPi / 64)));
    const Waves& above = rows[static_cast<std::size_t>(std::max(j, 0))];
    const Waves& below = rows[static_cast<std::size_t>(std::min(j + 1, e.height - 1))];
    for (int s = 0; s < steps; ++s) {
      for (const Node& node : kGauss4) {
        const double theta = from + (to - from) * (s + node.x) / steps;
        const double t = theta / row_height - 0.5 - j;
        Waves row;
        for (std::size_t k = 0; k < row.size(); ++k) row[k] = above[k] * (1 - t) + below[k] * t;
        add_parallel(row, theta, rotation, std::sin(theta) * node.weight * (to - from) / steps, order, sum);
      }
    }
  }
  std::vector<Vec3f> out;
  out.reserve(sum.size());
  for (const Vec3d& c : sum) out.push_back(to_float(c * static_cast<double>(e.intensity)));
  return out;
}

}  // namespace kiln
