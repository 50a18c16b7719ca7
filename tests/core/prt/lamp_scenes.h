#pragma once
// Scenes with lamps that have an area.

#include "tests/core/prt/test_scenes.h"

namespace kiln::testing {

/// A part that shines with this radiance and reflects nothing; returns its index.
inline std::uint32_t add_lamp_part(Scene& scene, const Vec3f& radiance, bool double_sided = false) {
  const std::uint32_t part = add_part(scene, {0, 0, 0}, double_sided);
  scene.materials.back().emission = radiance;
  return part;
}

/// A floor at y = 0 and a square lamp of half side 0.25 overhead that faces down: red, half as much green, no blue.
inline Scene lamp_scene(float height, float radiance) {
  Scene scene = empty_scene();
  add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  const std::uint32_t lamp = add_lamp_part(scene, {radiance, radiance / 2, 0});
  add_grid(scene, {-0.25F, height, -0.25F}, {0.5F, 0, 0}, {0, 0, 0.5F}, 1, 1, lamp);
  return scene;
}

}  // namespace kiln::testing
