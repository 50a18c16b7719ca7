#pragma once
// A line in a triangle's plane along which the mesh is to be cut, because light jumps there.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/plane_cut.h"
#include "core/prt/transfer_point.h"

namespace kiln {

/// Unit cube: what is nearer to a line or a place is on it. Half of what rays start aside of an edge (ray_origin.h):
/// they stay on their side of a line that was moved to a vertex.
inline constexpr double kSamePlace = 1e-6;
/// Unit cube: the height above a face at which rays start (offset_origin). Lines are those of the plane so high.
inline constexpr double kHair = 0x1p-19;

/// The plane of a triangle: origin at corner 0, x towards corner 1, z along the face normal of its winding.
struct TrianglePlane {
  Vec3d origin, x, y, z;

  TrianglePlane(const Mesh&, const Triangle&);
  Vec2d flat(const Vec3d& p) const { return {dot(p - origin, x), dot(p - origin, y)}; }
  Vec3d in_space(const Vec2d& p) const { return origin + x * p.x + y * p.y; }
};

std::array<Vec2d, 3> flat_corners(const Mesh&, const Triangle&, const TrianglePlane&);
/// 1, or -1 where the vertices' normals point to the other side of the face than z.
double lit_side(const Mesh&, const Triangle&, const TrianglePlane&);
/// Too small to be cut.
bool is_too_small(const std::array<Vec2d, 3>& corner);

struct CutLine {
  std::uint32_t triangle = 0;
  Segment line;  // in the triangle's plane
};

double length(const CutLine&);

/// The part of a segment inside a triangle that is kSamePlace larger all around.
std::optional<Segment> clipped(const Segment&, const std::array<Vec2d, 3>& corner);

/// How many lines a triangle of the mesh may have: 256, but about four million in all (8 where the mesh has half a
/// million triangles or more; 40 bytes each).
std::size_t most_lines(const Mesh&);
/// Of the lines of one triangle at most so many, the longest first.
void keep_longest(std::vector<CutLine>&, std::size_t most);

/// Points of the surface on either side of the middle of a line, clear of what stands there.
std::array<TransferPoint, 2> beside_line(const Mesh&, const CutLine&);

}  // namespace kiln
