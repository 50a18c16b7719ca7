#pragma once
// One primitive on its way into the scene: in its own coordinates, before and after cleaning.

#include <cstdint>
#include <string>
#include <vector>

#include "core/artifact/findings.h"
#include "core/mesh/mesh.h"

namespace kiln {

/// Every attribute is empty or has one element for each position. All numbers are finite.
struct RawPart {
  std::string name, place;
  int material = -1;
  std::vector<Vec3f> position, normal;
  std::vector<Vec2f> uv0, uv1;
  std::vector<Vec4f> color, tangent;
  std::vector<Triangle> triangles;
  std::vector<float> radiance;  // RFs in the axes of the positions: rows like those of LightField
};

enum class MissingNormals { flat, smooth };

/// Leaves only what a bake can use, and says what it did:
///   triangles without area and repeated triangles go; unreferenced vertices go;
///   missing normals are made from the faces (flat as glTF asks, by unsharing vertices, or smooth by area);
///   zero normals are made smooth, others brought to length 1; winding is turned round if most normals contradict it,
///   else the normals behind their faces are mirrored to the front;
///   tangents without direction drop the whole attribute.
/// Fails with position_out_of_range past 1e18.
/// Cost O(n) expected.
void clean_part(RawPart&, MissingNormals, Findings&);

/// Whether a triangle has no area worth the name: collinear within 1e-12 of its longest edge squared.
bool is_degenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c);

}  // namespace kiln
