#include "core/lightfield/lobe_fits.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/prt/lobe_table.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"
#include "core/trace/ggx.h"

namespace kiln {
namespace {

constexpr int kGrid = 48;               // samples a side, of the lobe and of the half space each
constexpr double kGrazing = 2e-3;       // the least n.l
constexpr double kUpright = 1 - 1e-12;  // the most
constexpr double kHorizon = 0.1;        // n.v below which radiance counts as that of the horizon
constexpr double kPi = std::numbers::pi;

struct Node {
  double z = 0, weight = 0;
};

/// Gauss-Legendre nodes of [0, 1].
std::vector<Node> height_nodes(int count) {
  std::vector<Node> out;
  for (const QuadratureNode& n : gauss_legendre(count)) out.push_back({(n.x + 1) / 2, n.weight / 2});
  return out;
}

Vec3d direction(double z, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(azimuth), r * std::sin(azimuth), z};
}

/// Equation 1 for functions over the half space of +z that are even about the plane of azimuth 0, by their moments.
class Fitter {
 public:
  explicit Fitter(int degree) : order_(degree + 1), y_(sh_count(order_)) {
    const int n = sh_count(order_), azimuths = 2 * order_ + 2;
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd y(n);
    for (const Node& node : height_nodes(order_ + 1)) {
      for (int k = 0; k < azimuths; ++k) {
        for (const double side : {1.0, -1.0}) {
          evaluate_sh(order_, direction(side * node.z, 2 * kPi * k / azimuths), y.data());
          gram += (side > 0 ? 1 : kBelow) * node.weight * 2 * kPi / azimuths * y * y.transpose();
        }
      }
    }
    solver_.compute(gram);
    below_ = zeros();
    for (const Node& node : height_nodes(order_ + 1)) {
      evaluate_sh(order_, direction(-node.z, 0), y.data());
      below_ += node.weight * y;
    }
  }

  int order() const { return order_; }
  Eigen::VectorXd zeros() const { return Eigen::VectorXd::Zero(sh_count(order_)); }

  /// Adds to the moments what functions bring there that are `light[k]` (times solid angle) at v: Y, and where v is
  /// near the horizon what the other half space goes on with.
  template <std::size_t kFunctions>
  void add(const Vec3d& v, const std::array<double, kFunctions>& light,
           std::array<Eigen::VectorXd, kFunctions>& moments) {
    evaluate_sh(order_, v, y_.data());
    if (v.z <= kHorizon) {
      const double azimuth = std::atan2(v.y, v.x), share = kBelow / kHorizon;
      for (int l = 0; l < order_; ++l) {
        for (int m = 0; m <= l; ++m) y_[l * (l + 1) + m] += share * below_[l * (l + 1) + m] * std::cos(m * azimuth);
      }
    }
    for (std::size_t k = 0; k < kFunctions; ++k) moments[k] += light[k] * y_;
  }

  Eigen::VectorXd solve(const Eigen::VectorXd& moments) const { return solver_.solve(moments); }

 private:
  int order_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
  Eigen::VectorXd below_;  // integrals of Y at azimuth 0 over the heights of the other half space
  Eigen::VectorXd y_;
};

/// Reflected about the normal, (x, y) goes to (-x, -y): odd m change their sign. Those of m < 0 are 0.
void store_even(const Eigen::VectorXd& fit, int order, float* out) {
  for (int l = 0; l < order; ++l) {
    for (int m = 0; m <= l; ++m) *out++ = static_cast<float>((m % 2 == 0 ? 1 : -1) * fit[l * (l + 1) + m]);
  }
}

/// Both parts of the lobe towards v, for light from l: all of it, times 1 - s and s.
struct Parts {
  double a = 0, b = 0;
};
Parts lobe_parts(double alpha, const Vec3d& v, const Vec3d& l) {
  const double all = ggx_cosine(alpha, v, l), s = schlick_weight(v, l);
  return {all * (1 - s), all * s};
}

/// Moments of the lobe of light from l by directions drawn from it and even ones, joined by the balance heuristic. Both
/// are drawn on one side of the plane of l (x, z): their images on the other bring the same. l must not be upright.
void fit_lobe(Fitter fitter, double alpha, const Vec3d& l, float* out) {
  std::array<Eigen::VectorXd, 2> moments{fitter.zeros(), fitter.zeros()};
  const auto add = [&](const Vec3d& v) {
    if (!(v.z > 0)) return;
    const Parts parts = lobe_parts(alpha, v, l);
    const double solid = 2 / ((ggx_density(alpha, l, v) + 0.5 / kPi) * kGrid * kGrid);
    fitter.add<2>(v, {parts.a * solid, parts.b * solid}, moments);
  };
  for (int i = 0; i < kGrid; ++i) {
    for (int j = 0; j < kGrid / 2; ++j) {
      const Vec2<double> u{(i + 0.5) / kGrid, (j + 0.5) / kGrid};
      add(sample_ggx(alpha, l, {u.x, u.y - 0.25}).l);
      add(direction(u.x, 2 * kPi * u.y));
    }
  }
  const std::size_t count = LobeFit::count(fitter.order() - 1);
  for (std::size_t part = 0; part < 2; ++part)
    store_even(fitter.solve(moments[part]), fitter.order(), out + part * count);
}

std::vector<float> fit_diffuse(Fitter fitter, const LobeTable& lobes, double roughness) {
  std::array<Eigen::VectorXd, 1> moments{fitter.zeros()};
  constexpr int kHeights = 64, kAzimuths = 2 * kMaxShOrder;
  for (const Node& node : height_nodes(kHeights)) {
    const double light = (1 - lobe_at(lobes, node.z, roughness).kept()) * node.weight * 2 * kPi / kAzimuths;
    for (int k = 0; k < kAzimuths; ++k) fitter.add<1>(direction(node.z, 2 * kPi * k / kAzimuths), {light}, moments);
  }
  const Eigen::VectorXd fit = fitter.solve(moments[0]);
  std::vector<float> out;
  for (int l = 0; l < fitter.order(); ++l) out.push_back(static_cast<float>(fit[l * (l + 1)]));
  return out;
}

double roughness_of(std::size_t row) { return static_cast<double>(row) / (kFitRows - 1); }
double row_place(double roughness) { return std::clamp(roughness, 0.0, 1.0) * (kFitRows - 1); }
std::size_t row_below(double roughness) {
  return static_cast<std::size_t>(std::min(row_place(roughness), kFitRows - 2.0));
}

void mix(std::vector<float>& a, const std::vector<float>& b, float share) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += (b[i] - a[i]) * share;
}

}  // namespace

LobeFits::LobeFits(int degree, Threads& threads, const RoughnessRange& range) : degree_(degree), rows_(kFitRows) {
  EXPECTS(degree >= 0 && degree < kMaxShOrder);
  EXPECTS(range.least <= range.most);
  const Fitter fitter(degree);
  const std::size_t count = LobeFit::count(degree), first = row_below(range.least);
  const std::size_t rows = row_below(range.most) + 2 - first;
  for (std::size_t row = first; row < first + rows; ++row) {
    rows_[row] = {degree, std::vector<float>(kFitColumns * 2 * count),
                  fit_diffuse(fitter, albedo_table(), roughness_of(row))};
  }
  threads.for_blocks(rows * kFitColumns, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t row = first + i / kFitColumns, column = i % kFitColumns;
      const double angle = kPi / 2 * static_cast<double>(column) / (kFitColumns - 1);
      const double z = std::clamp(std::cos(angle), kGrazing, kUpright);
      fit_lobe(fitter, ggx_alpha(roughness_of(row)), direction(z, 0), &rows_[row].lobe[column * 2 * count]);
    }
  });
}

LobeFit LobeFits::at(double roughness) const {
  const std::size_t row = row_below(roughness);
  EXPECTS(!rows_[row].lobe.empty() && !rows_[row + 1].lobe.empty());
  LobeFit out = rows_[row];
  const auto share = static_cast<float>(row_place(roughness) - static_cast<double>(row));
  mix(out.lobe, rows_[row + 1].lobe, share);
  mix(out.diffuse, rows_[row + 1].diffuse, share);
  return out;
}

LobeSum::LobeSum(const LobeFit& fit) : fit_(fit), sums_(3 * 2 * 2 * LobeFit::count(fit.degree), 0.0F) {}

void LobeSum::clear() { std::ranges::fill(sums_, 0.0F); }

void LobeSum::add(const Vec3f& l, const Vec3f& light) {
  if (!(l.z > 0)) return;
  const std::size_t count = LobeFit::count(fit_.degree);
  const float place = std::acos(std::min(l.z, 1.0F)) * static_cast<float>((kFitColumns - 1) / (kPi / 2));
  const auto column = static_cast<std::size_t>(std::clamp(place, 0.0F, kFitColumns - 2.0F));
  const float share = place - static_cast<float>(column);
  const float* low = &fit_.lobe[column * 2 * count];
  const float* high = low + 2 * count;
  // cos and sin of m times the azimuth.
  const float radius = std::sqrt(l.x * l.x + l.y * l.y);
  const float c = radius > 0 ? l.x / radius : 1, s = radius > 0 ? l.y / radius : 0;
  std::array<float, kMaxShOrder> cosine{1}, sine{0};
  for (std::size_t m = 1; m <= static_cast<std::size_t>(fit_.degree); ++m) {
    cosine[m] = cosine[m - 1] * c - sine[m - 1] * s;
    sine[m] = sine[m - 1] * c + cosine[m - 1] * s;
  }
  float* sum = sums_.data();
  const auto add_channel = [&](float x) {
    for (std::size_t part = 0; part < 2; ++part) {
      std::size_t k = part * count;
      for (std::size_t band = 0; band <= static_cast<std::size_t>(fit_.degree); ++band) {
        for (std::size_t m = 0; m <= band; ++m, ++k, sum += 2) {
          const float value = x * (low[k] + (high[k] - low[k]) * share);
          sum[0] += value * cosine[m];
          sum[1] += value * sine[m];
        }
      }
    }
  };
  add_channel(light.x), add_channel(light.y), add_channel(light.z);
}

void LobeSum::finish(const Vec3f& f0, const Vec3f& below, float scale, std::span<float> out) const {
  const std::size_t count = LobeFit::count(fit_.degree);
  const auto all = static_cast<std::size_t>(sh_count(fit_.degree + 1));
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const float* a = &sums_[channel * 4 * count];
    const float* b = a + 2 * count;
    float* to = &out[channel * all];
    for (int l = 0; l <= fit_.degree; ++l) {
      for (int m = 0; m <= l; ++m) {
        const auto k = static_cast<std::size_t>(l * (l + 1) / 2 + m), centre = static_cast<std::size_t>(l * (l + 1));
        const auto by = static_cast<std::size_t>(m);
        to[centre + by] = scale * (f0[channel] * a[2 * k] + b[2 * k]);
        if (m > 0) to[centre - by] = scale * (f0[channel] * a[2 * k + 1] + b[2 * k + 1]);
      }
      to[l * (l + 1)] += below[channel] * fit_.diffuse[static_cast<std::size_t>(l)];
    }
  }
}

}  // namespace kiln
