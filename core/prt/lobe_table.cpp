#include "core/prt/lobe_table.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"
#include "core/trace/ggx.h"

namespace kiln {
namespace {

constexpr int kGrid = 64;                     // samples of the lobe a side
constexpr double kY00 = 0.28209479177387814;  // 1 / (2 sqrt(pi))
constexpr double kRidge = 0.01;    // G's smallest eigenvalues are 1e-5: below this storage would be heard, not light
constexpr double kGrazing = 1e-3;  // the least n.v that is looked at

struct Drawn {
  Vec3d l;
  double weight = 0, fresnel = 0;
};

/// The lobe of one view by a regular grid over the visible normals.
std::vector<Drawn> draw_lobe(double alpha, const Vec3d& v) {
  std::vector<Drawn> out;
  for (int i = 0; i < kGrid; ++i) {
    for (int j = 0; j < kGrid; ++j) {
      const GgxSample s = sample_ggx(alpha, v, {(i + 0.5) / kGrid, (j + 0.5) / kGrid});
      if (s.weight > 0) out.push_back({s.l, s.weight, schlick_weight(v, s.l)});
    }
  }
  return out;
}

/// Mean of Y_i over the lobe.
std::vector<double> moments_of(const std::vector<Drawn>& lobe, int order) {
  std::vector<double> out(static_cast<std::size_t>(sh_count(order))), y(out.size());
  double all = 0;
  for (const Drawn& d : lobe) {
    evaluate_sh(order, d.l, y.data());
    for (std::size_t i = 0; i < y.size(); ++i) out[i] += d.weight * y[i];
    all += d.weight;
  }
  for (double& x : out) x /= all;
  return out;
}

using Axes = std::array<Vec3d, kLobeAxes>;

Axes axes_around(const Vec3d& normal, const Vec3d& away) {
  Axes out;
  for (std::size_t j = 0; j < out.size(); ++j) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(j) / kLobeAxes;
    out[j] = normal * std::cos(angle) + away * std::sin(angle);
  }
  return out;
}

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What does not change from entry to entry. Harmonics even about y = 0 only: m = 0 .. l of each band.
struct Fit {
  explicit Fit(int bands) : order(bands) {
    for (int l = 0; l < order; ++l) {
      for (int m = 0; m <= l; ++m) slots.push_back(static_cast<std::size_t>(l * (l + 1) + m));
    }
    const auto count = static_cast<Eigen::Index>(slots.size());
    above = MatrixXd::Zero(count, count);
    std::array<double, sh_count(kMaxLobeOrder)> y;
    for (const QuadratureNode& node : gauss_legendre(2 * order)) {
      const double z = (node.x + 1) / 2, r = std::sqrt(1 - z * z);
      const int azimuths = 2 * order + 2;
      for (int k = 0; k < azimuths; ++k) {
        const double phi = 2 * std::numbers::pi * (k + 0.5) / azimuths;
        evaluate_sh(order, Vec3d{r * std::cos(phi), r * std::sin(phi), z}, y.data());
        VectorXd even(count);
        for (Eigen::Index i = 0; i < count; ++i) even[i] = y[slots[static_cast<std::size_t>(i)]];
        above += even * even.transpose() * (node.weight / 2 * 2 * std::numbers::pi / azimuths);
      }
    }
    const Axes axes = axes_around({0, 0, 1}, {1, 0, 0});
    for (int l = 0; l < order; ++l) {
      along.emplace_back(l + 1, kLobeAxes);
      for (std::size_t j = 0; j < axes.size(); ++j) {
        evaluate_sh(l + 1, axes[j], y.data());
        for (int m = 0; m <= l; ++m)
          along.back()(m, static_cast<Eigen::Index>(j)) = y[static_cast<std::size_t>(l * (l + 1) + m)];
      }
    }
  }

  int order;
  std::vector<std::size_t> slots;
  MatrixXd above;               // G
  std::vector<MatrixXd> along;  // of band l: Y_lm of each axis
};

/// (G + ridge)^-1 q, scaled so that a constant light of 1 over an open point is seen as 1.
VectorXd fitted(const Fit& fit, const std::vector<double>& moments) {
  VectorXd q(fit.above.rows());
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = moments[fit.slots[static_cast<std::size_t>(i)]];
  const VectorXd out = (fit.above + MatrixXd::Identity(q.size(), q.size()) * kRidge).ldlt().solve(q);
  return out / (out.dot(fit.above.col(0)) * 2 * std::sqrt(std::numbers::pi));
}

void fill_entry(const Fit& fit, double alpha, double angle, float* out) {
  const double nv = std::max(kGrazing, std::cos(angle));
  const std::vector<Drawn> lobe = draw_lobe(alpha, {-std::sqrt(1 - nv * nv), 0, nv});  // leans to +x
  double a = 0, b = 0;
  for (const Drawn& d : lobe) {
    a += d.weight * (1 - d.fresnel) / (kGrid * kGrid);
    b += d.weight * d.fresnel / (kGrid * kGrid);
  }
  const VectorXd weight = fitted(fit, moments_of(lobe, fit.order));
  out[0] = static_cast<float>(a);
  out[1] = static_cast<float>(b);
  out[2] = static_cast<float>(weight[0] / kY00);
  Eigen::Index first = 1;
  for (int l = 1; l < fit.order; first += ++l) {
    const MatrixXd& y = fit.along[static_cast<std::size_t>(l)];
    const VectorXd gain = y.transpose() * (y * y.transpose()).ldlt().solve(weight.segment(first, l + 1));
    for (Eigen::Index j = 0; j < kLobeAxes; ++j) out[3 + kLobeAxes * (l - 1) + j] = static_cast<float>(gain[j]);
  }
}

/// A place between two entries.
struct Between {
  std::size_t first = 0;
  double share = 0;  // of the second
};

Between between(double x, int size) {
  const double at = std::clamp(x, 0.0, 1.0) * (size - 1);
  const double first = std::min(std::floor(at), size - 2.0);
  return {static_cast<std::size_t>(first), at - first};
}

}  // namespace

LobeTable make_lobe_table(int order) {
  EXPECTS(order >= 1 && order <= kMaxLobeOrder);
  LobeTable out{order, std::vector<float>(LobeTable::size_of(order), 0.0F)};
  const Fit fit(order);
  float* entry = out.numbers.data();
  for (int row = 0; row < kLobeRows; ++row) {
    const double alpha = ggx_alpha(static_cast<double>(row) / (kLobeRows - 1));
    for (int column = 0; column < kLobeViews; ++column, entry += out.width())
      fill_entry(fit, alpha, std::numbers::pi / 2 * column / (kLobeViews - 1), entry);
  }
  return out;
}

const LobeTable& albedo_table() {
  static const LobeTable table = make_lobe_table(1);
  return table;
}

Lobe lobe_at(const LobeTable& table, double nv, double roughness) {
  const auto width = static_cast<std::size_t>(table.width());
  const Between row = between(roughness, kLobeRows);
  const Between column = between(std::acos(std::clamp(nv, 0.0, 1.0)) / (std::numbers::pi / 2), kLobeViews);
  const auto number = [&](std::size_t k) {
    const float* at = &table.numbers[(row.first * kLobeViews + column.first) * width + k];
    const double low = at[0] * (1 - column.share) + at[width] * column.share;
    const double high = at[kLobeViews * width] * (1 - column.share) + at[(kLobeViews + 1) * width] * column.share;
    return low * (1 - row.share) + high * row.share;
  };
  Lobe out{table.order, number(0), number(1), number(2), {}};
  for (std::size_t k = 3; k < width; ++k) out.gain[1 + (k - 3) / kLobeAxes][(k - 3) % kLobeAxes] = number(k);
  return out;
}

LobeKernel lobe_kernel(const Lobe& lobe, const Vec3d& normal, const Vec3d& view) {
  const Vec3d away = normalized(normal * dot(normal, view) - view, basis_around(normal).x);
  LobeKernel out{lobe.constant * kY00}, y;
  for (std::size_t j = 0; const Vec3d& axis : axes_around(normal, away)) {
    evaluate_sh(lobe.order, axis, y.data());
    for (int l = 1; l < lobe.order; ++l) {
      const double gain = lobe.gain[static_cast<std::size_t>(l)][j];
      for (auto i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>((l + 1) * (l + 1)); ++i)
        out[i] += gain * y[i];
    }
    ++j;
  }
  return out;
}

Vec3d reflected_light(const Lobe& lobe, const Vec3d& normal, const Vec3d& view, const Vec3d* light) {
  const LobeKernel kernel = lobe_kernel(lobe, normal, view);
  Vec3d out;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(lobe.order)); ++i) out += light[i] * kernel[i];
  return {std::max(0.0, out.x), std::max(0.0, out.y), std::max(0.0, out.z)};
}

}  // namespace kiln
