#include "core/meshless/linear_weights.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln {
namespace {

constexpr std::size_t kSize = 4;
constexpr double kRidge = 0.05;          // of offsets, whose mean square is 1 over both axes
constexpr double kNormalRidge = 0.0025;  // a spread of normals of .05 (3 degrees) is half believed

using Vector = std::array<double, kSize>;
using Matrix = std::array<Vector, kSize>;

/// x of a x = b for a symmetric a that is positive definite.
Vector solve(Matrix a, Vector b) {
  for (std::size_t r = 0; r < kSize; ++r) {
    for (std::size_t k = r + 1; k < kSize; ++k) {
      const double factor = a[k][r] / a[r][r];
      for (std::size_t c = r; c < kSize; ++c) a[k][c] -= factor * a[r][c];
      b[k] -= factor * b[r];
    }
  }
  for (std::size_t r = kSize; r-- > 0;) {
    for (std::size_t c = r + 1; c < kSize; ++c) b[r] -= a[r][c] * b[c];
    b[r] /= a[r][r];
  }
  return b;
}

}  // namespace

void make_linear(const Vec3f& position, const Vec3f& normal, std::span<const SurfaceSite> sites,
                 std::vector<BasisTerm>& terms) {
  double spread = 0;
  for (const BasisTerm& t : terms) {
    const Vec3f offset = sites[t.function].position - position;
    spread += double{t.value} * dot(offset, offset);
  }
  const double scale = 1 / std::sqrt(std::max(spread, 1e-30));
  const Basis<float> frame = basis_around(normal);
  const auto moment = [&](const BasisTerm& t) {
    const SurfaceSite& site = sites[t.function];
    const Vec3f offset = site.position - position;
    return Vector{scale * dot(frame.x, offset), scale * dot(frame.y, offset), dot(frame.x, site.normal),
                  dot(frame.y, site.normal)};
  };
  Matrix a{};
  Vector b{};
  for (const BasisTerm& t : terms) {
    const Vector d = moment(t);
    for (std::size_t r = 0; r < kSize; ++r) {
      for (std::size_t c = 0; c < kSize; ++c) a[r][c] += double{t.value} * d[r] * d[c];
      b[r] -= double{t.value} * d[r];
    }
  }
  for (std::size_t r = 0; r < kSize; ++r) a[r][r] += r < 2 ? kRidge : kNormalRidge;
  const Vector q = solve(a, b);
  float sum = 0;
  for (BasisTerm& t : terms) {
    const Vector d = moment(t);
    t.value *= static_cast<float>(1 + q[0] * d[0] + q[1] * d[1] + q[2] * d[2] + q[3] * d[3]);
    sum += t.value;
  }
  for (BasisTerm& t : terms) t.value /= sum;
}

}  // namespace kiln
