#include "core/artifact/eye.h"

#include <algorithm>
#include <array>
#include <utility>

namespace kiln {
namespace {

/// Light that arrives at a point of a triangle.
void arriving_at(const GlossyTransfer& glossy, const LitComponents& lit, const TrianglePoint& place, Vec3d* out) {
  const std::array<double, 3> weight{1 - double{place.u} - place.v, place.u, place.v};
  std::array<Vec3d, sh_count(kMaxLobeOrder)> corner;
  std::fill_n(out, glossy.outputs(), Vec3d{});
  for (std::size_t k = 0; k < 3; ++k) {
    incident_light(glossy, lit, glossy.find(place.triangle[k]), corner.data());
    for (std::size_t o = 0; o < static_cast<std::size_t>(glossy.outputs()); ++o) out[o] += corner[o] * weight[k];
  }
}

}  // namespace

bool has_matrices(const GlossyTransfer& glossy, const Triangle& triangle) {
  return std::ranges::all_of(triangle, [&](auto v) { return glossy.find(v) != GlossyTransfer::kNoMatrix; });
}

EyeLight eye_light(const BakedScene& baked, std::vector<Vec3f> coefficients, bool lamps) {
  EyeLight out{std::move(coefficients), {}, lamps, {}};
  if (baked.glossy) out.lit = light_components(baked.glossy, out.coefficients, lamps);
  return out;
}

EyeLight eye_light(const BakedScene& baked, const LightParts& light) {
  EyeLight out = eye_light(baked, {light.all.begin(), light.all.end()}, true);
  out.bright.assign(light.bright.begin(), light.bright.end());
  return out;
}

EyeRadiance eye_radiance(const BakedScene& baked, const EyeLight& light, const EyePoint& point) {
  const Vec3d value = to_double(light.lamps ? shown_at(baked.transfer, point.place, {light.coefficients, light.bright})
                                            : distant_value_at(baked.transfer, point.place, light.coefficients));
  const EyeMaterial& material = point.material;
  if (!baked.glossy || !has_matrices(baked.glossy, point.place.triangle)) return {material.base_color * value, {}};
  std::array<Vec3d, sh_count(kMaxLobeOrder)> arriving;
  arriving_at(baked.glossy, light.lit, point.place, arriving.data());
  const Lobe lobe = lobe_at(baked.lobes, dot(point.normal, point.view), material.roughness);
  return {material.diffuse * value * (1 - lobe.kept()),
          lobe.albedo(material.f0) * reflected_light(lobe, point.normal, point.view, arriving.data())};
}

}  // namespace kiln
