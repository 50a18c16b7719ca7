#pragma once
// Which vertices are one point of the surface, so that a seam moves as one and no crack opens.
//
// Triangles are glued where they share an edge in space and run along it in opposite directions: first those that share
// its vertices too (sheets that lie on each other stay two sheets), then pairs that are left over (seams of normals,
// texture coordinates, radiance or parts). Of more than two, those that run on into each other within 45 degrees are
// one sheet that the others touch. A point is a fan of glued triangles, hence manifold; its vertices are the seams'
// sides. A vertex of several fans is copied for each. What cannot be glued by these rules (more triangles on an edge,
// neighbours wound against each other) is locked: its points never move, so it stays shut.
// Cost    n log n.        Repeat  same bits always.       Fails   never

#include <cstdint>
#include <vector>

#include "core/lightfield/lit_mesh.h"

namespace kiln {

struct SurfacePoints {
  std::vector<std::uint32_t> point;  // of each vertex; kNone where no triangle uses it
  std::vector<bool> locked;          // of each point
  static constexpr std::uint32_t kNone = 0xffffffffU;
};

/// Drops triangles that have two corners in one place, and all but the first of those with the same three vertices in
/// the same winding; then copies vertices as said.
SurfacePoints find_surface_points(LitMesh&);

}  // namespace kiln
