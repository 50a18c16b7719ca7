#pragma once
// The material of a point as an eye sees it: core/trace reads the scene, core/artifact shows it.

#include "core/artifact/eye.h"
#include "core/trace/ggx.h"
#include "core/trace/surface.h"

namespace kiln {

inline EyeMaterial eye_material(const Scene& scene, const SurfacePoint& point) {
  const Vec3d color = to_double(albedo_at(scene, point));
  const SurfaceFinish finish = finish_at(scene, point);
  return {color, diffuse_color(color, finish.metallic), specular_f0(color, finish.metallic), finish.roughness};
}

}  // namespace kiln
