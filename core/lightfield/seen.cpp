#include "core/lightfield/seen.h"

#include <algorithm>
#include <array>

namespace kiln {

Vec3d seen_radiance(const LightField& field, const Triangle& triangle, double u, double v, const Vec3d& normal,
                    const Vec3d& view) {
  const double above = dot(normal, view);
  const Vec3d seen = above >= 0 ? view : normalized(view - normal * above, normal);
  std::array<double, sh_count(kMaxLightFieldDegree + 1)> y{};
  evaluate_sh(field.degree + 1, normal * (2 * std::max(0.0, above)) - seen, y.data());
  const std::array<double, 3> weight{1 - u - v, u, v};
  Vec3d out;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::span<const float> c = field.of(triangle[k]);
    for (std::size_t i = 0; i < field.count(); ++i) {
      const double w = weight[k] * y[i];
      out += Vec3d{c[i], c[field.count() + i], c[2 * field.count() + i]} * w;
    }
  }
  return {std::max(0.0, out.x), std::max(0.0, out.y), std::max(0.0, out.z)};
}

}  // namespace kiln
