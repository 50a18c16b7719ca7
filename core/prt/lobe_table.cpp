#include "core/prt/lobe_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/sphere/sh.h"
#include "core/trace/ggx.h"

namespace kiln {
namespace {

constexpr int kGrid = 64;          // samples of the lobe a side
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

using Axes = std::array<Vec3d, 3>;

Axes axes_around(const Vec3d& normal, const Vec3d& away) {
  return {normal, (normal + away) * std::numbers::sqrt2 / 2.0, away};
}

/// The axes that band l needs, one for each m = l, l - 2, .. >= 0: odd bands are 0 along the normal.
std::vector<std::size_t> axes_of_band(int l) {
  if (l == 1) return {2};
  if (l == 2) return {0, 2};
  return l == 3 ? std::vector<std::size_t>{1, 2} : std::vector<std::size_t>{0, 1, 2};
}

/// Solves sum_j g_j Y_lm(axis_j) = moment_lm for m = l, l - 2, .. >= 0 by elimination; at most three equations, whose
/// determinants are far from 0.
void solve_band(int l, const std::vector<double>& moments, float* gain) {
  const std::vector<std::size_t> used = axes_of_band(l);
  const std::size_t n = used.size();
  const Axes axes = axes_around({0, 0, 1}, {1, 0, 0});
  std::array<std::array<double, 4>, 3> rows{};
  std::array<double, sh_count(kMaxLobeOrder)> y;
  for (std::size_t j = 0; j < n; ++j) {
    evaluate_sh(l + 1, axes[used[j]], y.data());
    for (std::size_t r = 0; r < n; ++r) rows[r][j] = y[static_cast<std::size_t>(l * (l + 1) + l) - 2 * r];
  }
  for (std::size_t r = 0; r < n; ++r) rows[r][3] = moments[static_cast<std::size_t>(l * (l + 1) + l) - 2 * r];
  for (std::size_t pivot = 0; pivot < n; ++pivot) {
    for (std::size_t r = pivot + 1; r < n; ++r) {
      if (std::abs(rows[r][pivot]) > std::abs(rows[pivot][pivot])) std::swap(rows[r], rows[pivot]);
    }
    for (std::size_t r = 0; r < n; ++r) {
      const double share = rows[r][pivot] / rows[pivot][pivot];
      for (std::size_t k = pivot; r != pivot && k < 4; ++k) rows[r][k] -= share * rows[pivot][k];
    }
  }
  for (std::size_t j = 0; j < n; ++j) gain[used[j]] = static_cast<float>(rows[j][3] / rows[j][j]);
}

void fill_entry(int order, double alpha, double angle, float* out) {
  const double nv = std::max(kGrazing, std::cos(angle));
  const std::vector<Drawn> lobe = draw_lobe(alpha, {-std::sqrt(1 - nv * nv), 0, nv});  // leans to +x
  double a = 0, b = 0;
  for (const Drawn& d : lobe) {
    a += d.weight * (1 - d.fresnel) / (kGrid * kGrid);
    b += d.weight * d.fresnel / (kGrid * kGrid);
  }
  out[0] = static_cast<float>(a);
  out[1] = static_cast<float>(b);
  const std::vector<double> moments = moments_of(lobe, order);
  for (int l = 1; l < order; ++l) solve_band(l, moments, out + 2 + 3 * (l - 1));
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
  float* entry = out.numbers.data();
  for (int row = 0; row < kLobeRows; ++row) {
    const double alpha = ggx_alpha(static_cast<double>(row) / (kLobeRows - 1));
    for (int column = 0; column < kLobeViews; ++column, entry += out.width())
      fill_entry(order, alpha, std::numbers::pi / 2 * column / (kLobeViews - 1), entry);
  }
  return out;
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
  Lobe out{table.order, number(0), number(1)};
  for (std::size_t k = 2; k < width; ++k) out.gain[1 + (k - 2) / 3][(k - 2) % 3] = number(k);
  return out;
}

Vec3d reflected_light(const Lobe& lobe, const Vec3d& normal, const Vec3d& view, const Vec3d* light) {
  const Vec3d away = normalized(normal * dot(normal, view) - view, basis_around(normal).x);
  const Axes axes = axes_around(normal, away);
  std::array<double, sh_count(kMaxLobeOrder)> y;
  Vec3d out = light[0] * (2 * 0.28209479177387814);  // Y(0,0)
  for (std::size_t j = 0; j < 6; ++j) {
    const Vec3d& axis = axes[j % 3];
    evaluate_sh(lobe.order, j < 3 ? axis : axis - normal * (2 * dot(axis, normal)), y.data());
    for (int l = 1; l < lobe.order; ++l) {
      const double gain = lobe.gain[static_cast<std::size_t>(l)][j % 3];
      for (auto i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>((l + 1) * (l + 1)); ++i)
        out += light[i] * (gain * y[i]);
    }
  }
  return {std::max(0.0, out.x), std::max(0.0, out.y), std::max(0.0, out.z)};
}

}  // namespace kiln
