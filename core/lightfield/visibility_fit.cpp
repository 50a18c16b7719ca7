#include "core/lightfield/visibility_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace kiln {
namespace {
constexpr double kRidge = 1e-3;
}

void VisibilityFit::Moments::add(const std::array<double, kVisibilityCount>& y, double weight, bool is_seen) {
  for (std::size_t i = 0; i < kVisibilityCount; ++i) {
    for (std::size_t k = 0; k <= i; ++k) products[i * kVisibilityCount + k] += weight * y[i] * y[k];
    if (is_seen) seen[i] += weight * y[i];
  }
  all += weight;
}

void VisibilityFit::add(const Vec3f& w, bool even, double light, bool seen) {
  std::array<double, kVisibilityCount> y{};
  evaluate_sh(kVisibilityOrder, to_double(w), y.data());
  if (even) even_.add(y, 1, seen);
  if (light > 0) light_.add(y, light, seen);
}

SkyVisibility VisibilityFit::fit() const {
  constexpr auto n = static_cast<Eigen::Index>(kVisibilityCount);
  using Square = Eigen::Matrix<double, n, n>;
  using Column = Eigen::Matrix<double, n, 1>;
  Square products = Square::Zero();
  Column seen = Column::Zero();
  double parts = 0;
  for (const Moments* m : {&even_, &light_}) {
    if (!(m->all > 0)) continue;
    products += Eigen::Map<const Eigen::Matrix<double, n, n, Eigen::RowMajor>>(m->products.data()) / m->all;
    seen += Eigen::Map<const Column>(m->seen.data()) / m->all;
    parts += 1;
  }
  SkyVisibility out{};
  if (!(parts > 0)) return out;
  products.triangularView<Eigen::StrictlyUpper>() = products.transpose();
  Column mean = Column::Zero();
  mean[0] = seen[0] / products(0, 0);
  const Column from_mean = (products + kRidge * Square::Identity()).ldlt().solve(seen - products * mean);
  for (std::size_t i = 0; i < kVisibilityCount; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    out[i] = static_cast<float>(mean[row] + from_mean[row]);
  }
  return out;
}

}  // namespace kiln
