#include "core/bake/field_eye.h"

#include "core/bake/eye_material.h"

namespace kiln {

FieldEye::FieldEye(const Scene& scene, const LightField& field, const SkyLevels& sky) : scene_(scene), field_(field) {
  if (field.has_sky()) sky_.emplace(sky);
}

Vec3d FieldEye::seen(const SurfaceMatch& place, const Vec3d& normal, const Vec3d& view) const {
  FieldPoint at{scene_.mesh.triangles[place.triangle], place.u, place.v, normal, view};
  if (sky_ || field_.has_lamps()) {
    const EyeMaterial material = eye_material(
        scene_, surface_point(scene_, place.triangle, static_cast<float>(place.u), static_cast<float>(place.v)));
    at.f0 = material.f0, at.roughness = material.roughness;
    const std::vector<Vec3f>& corner = scene_.mesh.position;
    at.place = to_double(corner[at.triangle[0]]) * (1 - place.u - place.v) +
               to_double(corner[at.triangle[1]]) * place.u + to_double(corner[at.triangle[2]]) * place.v;
  }
  return seen_radiance(field_, sky_ ? &*sky_ : nullptr, at);
}

}  // namespace kiln
