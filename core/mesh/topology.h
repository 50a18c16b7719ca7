#pragma once
// Connectivity by position: which vertices are one point in space.

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

/// For each vertex the lowest vertex at bit-equal position (-0 counts as +0). Cost O(n) expected.
std::vector<std::uint32_t> weld_by_position(const std::vector<Vec3f>& position);

/// Twice-area vector of a triangle: its direction is the face normal by winding.
Vec3f area_vector(const Mesh&, const Triangle&);
Vec3f centroid(const Mesh&, const Triangle&);
double triangle_area(const Mesh&, const Triangle&);
double surface_area(const Mesh&);

}  // namespace kiln
