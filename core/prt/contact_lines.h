#pragma once
// Contact lines: where other surfaces stand on a triangle or pierce it, the foot of a column, a beam in a wall. Light
// jumps there.
//
// Lines are those of the triangle's plane a hair above it: what touches it exactly stands on it, what lies in its plane
// does not.   Repeat  same bits for any thread count

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/mesh/plane_cut.h"
#include "core/prt/transfer_point.h"

namespace kiln {

/// Unit cube: what is nearer to a line or a place is on it. Half of what rays start aside of an edge (ray_origin.h):
/// they stay on their side of a line that was moved to a vertex.
inline constexpr double kSamePlace = 1e-6;

/// The plane of a triangle: origin at corner 0, x towards corner 1, z along the face normal of its winding.
struct TrianglePlane {
  Vec3d origin, x, y, z;

  TrianglePlane(const Mesh&, const Triangle&);
  Vec2d flat(const Vec3d& p) const { return {dot(p - origin, x), dot(p - origin, y)}; }
  Vec3d in_space(const Vec2d& p) const { return origin + x * p.x + y * p.y; }
};

struct ContactLine {
  std::uint32_t triangle = 0;
  Segment line;  // in the triangle's plane
};

double length(const ContactLine&);

/// All lines that triangles with `stands[t]` make on the mesh, by triangle, of one triangle the longest first and at
/// most 256 (8 where the mesh has half a million triangles or more: 40 bytes each). What lies within three degrees of
/// its plane makes none: tiles that overlap.
std::vector<ContactLine> find_contact_lines(const Mesh&, const std::vector<bool>& stands, Threads&);

/// Points of the surface on either side of the middle of a line, clear of what stands there.
std::array<TransferPoint, 2> beside_line(const Mesh&, const ContactLine&);

}  // namespace kiln
