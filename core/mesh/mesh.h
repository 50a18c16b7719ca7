#pragma once
// The one mesh type: plain arrays over all triangles of a scene.

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

using Triangle = std::array<std::uint32_t, 3>;

/// Positions are in the scene's unit cube (see Frame in core/scene/scene.h). A vertex belongs to one part only.
/// uv0, uv1, color and tangent are empty or have one element for each vertex.
struct Mesh {
  std::vector<Vec3f> position;
  std::vector<Vec3f> normal;  // unit length, always present
  std::vector<Vec2f> uv0;     // as in glTF: v runs downwards
  std::vector<Vec2f> uv1;
  std::vector<Vec4f> color;    // linear RGBA that multiplies the base colour
  std::vector<Vec4f> tangent;  // xyz unit, w = +-1
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> part;  // of each triangle: index into Scene::parts
};

}  // namespace kiln
