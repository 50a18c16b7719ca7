#include "core/meshless/anderson.h"

#include <array>
#include <cmath>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr std::size_t kMost = AndersonMixing::kDepth;
using Row = std::array<double, kMost + 1>;

double product(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += double{a[i].x} * b[i].x + double{a[i].y} * b[i].y + double{a[i].z} * b[i].z;
  return sum;
}

std::vector<Vec3f> difference(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  std::vector<Vec3f> out(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) out[i] = a[i] - b[i];
  return out;
}

/// Solves n equations whose last column is the right side, by elimination of a positive matrix; what is no more than
/// rounding of the diagonal counts as 0, and so does its unknown.
std::array<double, kMost> solve(std::array<Row, kMost>& rows, std::size_t n) {
  constexpr double kRounding = 1e-10;
  std::array<double, kMost> diagonal{}, out{};
  for (std::size_t i = 0; i < n; ++i) diagonal[i] = rows[i][i];
  for (std::size_t i = 0; i < n; ++i) {
    if (!(rows[i][i] > kRounding * diagonal[i])) {
      rows[i].fill(0);
      continue;
    }
    for (std::size_t k = i + 1; k < n; ++k) {
      const double factor = rows[k][i] / rows[i][i];
      for (std::size_t c = i; c <= kMost; ++c) rows[k][c] -= factor * rows[i][c];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    double rest = rows[i][kMost];
    for (std::size_t c = i + 1; c < n; ++c) rest -= rows[i][c] * out[c];
    out[i] = rows[i][i] > 0 ? rest / rows[i][i] : 0;
  }
  return out;
}

}  // namespace

std::vector<Vec3f> AndersonMixing::next(const std::vector<Vec3f>& x, const std::vector<Vec3f>& g) {
  EXPECTS(x.size() == g.size() && (last_g_.empty() || last_g_.size() == g.size()));
  std::vector<Vec3f> f = difference(g, x);
  if (!last_g_.empty()) {
    if (df_.size() == kDepth) df_.erase(df_.begin()), dg_.erase(dg_.begin());
    df_.push_back(difference(f, last_f_));
    dg_.push_back(difference(g, last_g_));
  }
  std::array<Row, kMost> rows{};
  for (std::size_t i = 0; i < df_.size(); ++i) {
    for (std::size_t k = 0; k < df_.size(); ++k) rows[i][k] = product(df_[i], df_[k]);
    rows[i][kMost] = product(df_[i], f);
  }
  const std::array<double, kMost> gamma = solve(rows, df_.size());
  std::vector<Vec3f> out = g;
  for (std::size_t k = 0; k < dg_.size(); ++k) {
    const auto weight = static_cast<float>(gamma[k]);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] -= dg_[k][i] * weight;
  }
  last_f_ = std::move(f);
  last_g_ = g;
  return out;
}

}  // namespace kiln
