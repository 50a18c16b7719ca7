#pragma once
// Where the rays of a surface point start.
//
// A vertex lies on the very edge of its faces: on a wall, in a corner, under the foot of a column. Its rays start a
// hair inside one adjacent face, lifted off it along the shading normal:
//  - rays towards a wall that meets the surface at the vertex hit it, they do not look through it;
//  - rays below the horizon of a face are stopped by that face itself, as they are on the surface between vertices,
//    so a shading normal that differs from the face's lets no light leak through;
//  - what the lift moves along the face is less than the pull: a normal that leans towards a wall takes no ray outside;
//  - the lift is no smaller than the pull, so that the tip of a smooth convex surface sees what the tip sees and has no
//    dark rim. (Where nothing rises above the tangent plane no ray is traced at all.)
// Both lengths are far below 1e-5 of the scene: no thin neighbour is skipped.

#include <cstdint>
#include <span>
#include <vector>

#include "core/prt/transfer_point.h"

namespace kiln {

inline constexpr float kFar = 4;                // longer than any segment in the unit cube
inline constexpr float kOpenTolerance = 5e-7F;  // rounding of n . x in the unit cube, a few units in the last place

Vec3f ray_origin(const TransferPoint&);

/// The name of a point for random numbers: its own bits, so that a point has the same noise wherever it is asked.
std::uint64_t point_key(const TransferPoint&);

std::vector<std::uint32_t> morton_order_of(std::span<const TransferPoint>);

}  // namespace kiln
