#pragma once
// Vertices along an edge, or inside a triangle.

#include <cstdint>

#include "core/mesh/mesh.h"

namespace kiln {

/// The middle of two points, the same bits in either order.
inline Vec3f middle(const Vec3f& a, const Vec3f& b) { return (a + b) * 0.5F; }

/// The unit normal halfway along an edge; that of the lower index where the two cancel.
Vec3f middle_normal(const Mesh&, std::uint32_t a, std::uint32_t b);

/// Appends the vertex halfway between a and b and returns its index. Every attribute of the mesh is interpolated;
/// normal and tangent are made unit again (a tangent is that of the lower index where the two cancel; so is its sign).
std::uint32_t append_midpoint(Mesh&, std::uint32_t a, std::uint32_t b);

/// The same at `share` of the way from a to b. The position is the same bits for vertices at the places of a and b.
std::uint32_t append_between(Mesh&, std::uint32_t a, std::uint32_t b, float share);

/// The same inside a triangle: (1 - u - v), u and v are the weights of its corners.
std::uint32_t append_inside(Mesh&, const Triangle& corner, float u, float v);

}  // namespace kiln
