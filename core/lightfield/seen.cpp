#include "core/lightfield/seen.h"

#include <algorithm>
#include <array>

#include "core/prt/lobe_table.h"

namespace kiln {

Vec3d seen_radiance(const LightField& field, const MirroredSky* sky, const FieldPoint& at) {
  const Vec3d& normal = at.normal;
  const double above = dot(normal, at.view);
  const Vec3d seen = above >= 0 ? at.view : normalized(at.view - normal * above, normal);
  std::array<double, sh_count(kMaxLightFieldDegree + 1)> y{};
  evaluate_sh(field.degree + 1, normal * (2 * std::max(0.0, above)) - seen, y.data());
  const std::array<double, 3> weight{1 - at.u - at.v, at.u, at.v};
  Vec3d out, mean, diffuse;
  SkyVisibility visibility{};
  std::array<double, kMostFieldLamps> lamps{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::span<const float> c = field.of(at.triangle[k]);
    for (std::size_t i = 0; i < field.count(); ++i) {
      const double w = weight[k] * y[i];
      out += Vec3d{c[i], c[field.count() + i], c[2 * field.count() + i]} * w;
    }
    mean += Vec3d{c[0], c[field.count()], c[2 * field.count()]} * (weight[k] * y[0]);
    for (std::size_t i = 0; i < field.lamps.size(); ++i)
      lamps[i] += weight[k] * double{field.lamp_visibility[field.lamps.size() * at.triangle[k] + i]};
    if (field.has_diffuse()) {
      const float* light = &field.diffuse[std::size_t{3} * at.triangle[k]];
      diffuse += Vec3d{light[0], light[1], light[2]} * weight[k];
    }
    if (!field.has_sky()) continue;
    const float* own = &field.visibility[kVisibilityCount * at.triangle[k]];
    for (std::size_t i = 0; i < kVisibilityCount; ++i) visibility[i] += static_cast<float>(weight[k]) * own[i];
  }
  if (sky != nullptr) out += sky->seen({normal, at.f0, at.roughness}, visibility, seen);
  if (field.has_lamps()) out += lamp_highlights(field.lamps, lamps, {at.place, normal, seen, at.f0, at.roughness});
  if (field.has_diffuse()) {
    const Vec3d sent = at.color * diffuse * (1 - lobe_at(albedo_table(), dot(normal, seen), at.roughness).kept());
    out += sent, mean += sent;
  }
  const double share = field.has_sky() ? kLeastSeen : 0;
  for (std::size_t c = 0; c < 3; ++c) out[c] = std::max({0.0, share * mean[c], out[c]});
  return out;
}

}  // namespace kiln
