#pragma once
// Scenes that nobody should have, and somebody has.

#include <vector>

#include "tests/core/prt/test_scenes.h"

namespace kiln::testing {

/// One triangle; one without area; sheets that coincide; random triangles.
inline std::vector<Scene> odd_scenes(int random_triangles) {
  Scene one = empty_scene();
  one.mesh.position = {{-0.5F, 0, -0.5F}, {0, 0, 0.5F}, {0.5F, 0, -0.5F}};
  one.mesh.normal.assign(3, {0, 1, 0});
  one.mesh.triangles = {{0, 1, 2}};
  one.mesh.part = {0};
  Scene flat = one;
  flat.mesh.position[2] = flat.mesh.position[0];
  Scene sheets = empty_scene();
  for (const float height : {0.0F, 0.0F, 1e-6F}) add_grid(sheets, {-0.5F, height, -0.5F}, {0, 0, 1}, {1, 0, 0}, 3, 3);
  return {one, flat, sheets, random_scene(7, random_triangles)};
}

}  // namespace kiln::testing
