#include "core/lightfield/mean_radiance.h"

#include <algorithm>
#include <array>

namespace kiln {
namespace {

constexpr auto kBands = static_cast<std::size_t>(kMaxLightFieldDegree) + 1;

/// lambda_l = (P_{l-1}(0) - P_{l+1}(0)) / (2 l + 1).
std::array<double, kBands> means_of_bands() {
  std::array<double, kBands + 1> at_zero{1, 0};
  for (std::size_t l = 2; l <= kBands; ++l)
    at_zero[l] = -static_cast<double>(l - 1) / static_cast<double>(l) * at_zero[l - 2];
  std::array<double, kBands> out{1};
  for (std::size_t l = 1; l < kBands; ++l) out[l] = (at_zero[l - 1] - at_zero[l + 1]) / static_cast<double>(2 * l + 1);
  return out;
}

}  // namespace

std::vector<Vec3f> mean_radiance(const LightField& field, std::span<const Vec3f> normal) {
  const std::array<double, kBands> lambda = means_of_bands();
  std::array<double, kBands * kBands> y{};
  std::vector<Vec3f> out;
  out.reserve(normal.size());
  for (std::size_t v = 0; v < normal.size(); ++v) {
    evaluate_sh(field.degree + 1, to_double(normal[v]), y.data());
    const std::span<const float> c = field.of(v);
    Vec3d sum;
    for (std::size_t l = 0, i = 0; i < field.count(); ++l) {
      for (const std::size_t end = (l + 1) * (l + 1); i < end; ++i)
        sum += Vec3d{c[i], c[field.count() + i], c[2 * field.count() + i]} * (lambda[l] * y[i]);
    }
    out.push_back(to_float({std::max(0.0, sum.x), std::max(0.0, sum.y), std::max(0.0, sum.z)}));
  }
  return out;
}

}  // namespace kiln
