#include "core/lightfield/lamp_highlights.h"

#include <algorithm>
#include <cmath>

#include "core/trace/ggx.h"
#include "core/trace/lights.h"

namespace kiln {

Vec3d lamp_highlights(std::span<const FieldLamp> lamps, std::span<const double> seen, const LampEye& eye) {
  constexpr double kGrazing = 1e-3;
  const double above = dot(eye.normal, eye.view), z = std::clamp(above, kGrazing, 1.0);
  const double alpha = ggx_alpha(eye.roughness);
  const Vec3d x = normalized(eye.view - eye.normal * above, basis_around(eye.normal).x), y = cross(eye.normal, x);
  const Vec3d v{std::sqrt(1 - z * z), 0, z};
  Vec3d sum;
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    if (!(seen[k] > 0)) continue;
    const LightArrival arrival = light_arrival(lamps[k].light, eye.place);
    const Vec3d l{dot(arrival.direction, x), dot(arrival.direction, y), dot(arrival.direction, eye.normal)};
    const double lobe = ggx_cosine(alpha, v, l);
    if (!(lobe > 0)) continue;
    sum += (eye.f0 + (Vec3d{1, 1, 1} - eye.f0) * schlick_weight(v, l)) * arrival.irradiance * (lobe * seen[k]);
  }
  return sum;
}

}  // namespace kiln
