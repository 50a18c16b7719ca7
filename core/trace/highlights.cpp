#include "core/trace/highlights.h"

#include <cmath>
#include <limits>

#include "core/trace/ggx.h"
#include "core/trace/lights.h"

namespace kiln {

Vec3d punctual_highlights(const Tracer& tracer, const EyedPoint& eyed) {
  const Basis<double> basis = basis_around(normalized(to_double(eyed.at.normal)));
  const Vec3d v = basis.to_local(to_double(eyed.view));
  const Vec3f origin = offset_origin(eyed.at.position, eyed.at.face_normal);
  Vec3d sum;
  for (const Light& light : tracer.scene().lights) {
    const LightArrival arrival = light_arrival(light, to_double(origin));
    const Vec3d l = basis.to_local(arrival.direction);
    const double lobe = ggx_cosine(eyed.alpha, v, l);
    if (!(lobe > 0) || arrival.irradiance == Vec3d{}) continue;
    const float far =
        std::isfinite(arrival.distance) ? static_cast<float>(arrival.distance) : std::numeric_limits<float>::infinity();
    if (tracer.occluded(origin, to_float(arrival.direction), far)) continue;
    sum += (eyed.f0 + (Vec3d{1, 1, 1} - eyed.f0) * schlick_weight(v, l)) * arrival.irradiance * lobe;
  }
  return sum;
}

}  // namespace kiln
