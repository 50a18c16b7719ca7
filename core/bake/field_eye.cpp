#include "core/bake/field_eye.h"

#include "core/bake/eye_material.h"

namespace kiln {

FieldEye::FieldEye(const Scene& scene, const LightField& field, const SkyLevels& sky) : scene_(scene), field_(field) {
  if (field.has_sky()) sky_.emplace(sky);
}

Vec3d FieldEye::seen(const SurfaceMatch& place, const Vec3d& normal, const Vec3d& view) const {
  FieldPoint at{scene_.mesh.triangles[place.triangle], place.u, place.v, normal, view};
  const bool colored = sky_ || field_.has_lamps() || field_.has_diffuse();
  if (!colored && !field_.emission_apart) return seen_radiance(field_, nullptr, at);
  const SurfacePoint point =
      surface_point(scene_, place.triangle, static_cast<float>(place.u), static_cast<float>(place.v));
  if (colored) {
    const EyeMaterial material = eye_material(scene_, point);
    at.f0 = material.f0, at.roughness = material.roughness, at.color = material.diffuse;
    const std::vector<Vec3f>& corner = scene_.mesh.position;
    at.place = to_double(corner[at.triangle[0]]) * (1 - place.u - place.v) +
               to_double(corner[at.triangle[1]]) * place.u + to_double(corner[at.triangle[2]]) * place.v;
  }
  const Vec3d seen = seen_radiance(field_, sky_ ? &*sky_ : nullptr, at);
  return field_.emission_apart ? seen + to_double(emission_at(scene_, point)) : seen;
}

}  // namespace kiln
