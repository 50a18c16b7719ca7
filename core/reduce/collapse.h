#pragma once
// Edge collapse with quadrics: a surface in memory down to a number of triangles.
//
// The edge whose joint vertex adds least to the squared error goes first; the joint vertex lies where the sum of both
// quadrics is least. A collapse is refused where it would turn a triangle over, pinch the surface (link condition) or
// tie two borders together. Where only refused ones are left, a second round lets the surface pinch: small pieces
// vanish.
//
// Paper    [GarlandHeckbert97]; [GarlandShaffer02]: quadrics of the clusters go on counting after clustering
// Cost     O(n log n), about 2 us a collapse
// Repeat   same bits always: one thread, ties by vertex number
// Differs  a closed piece of four triangles goes as a whole; non-manifold edges take part

#include <functional>

#include "core/base/threads.h"
#include "core/reduce/surface.h"

namespace kiln {

/// Leaves at most `triangles` where it can. `tell(left)` is called now and then, with the triangles that are left.
/// Throws Cancelled when `threads` is stopped.
void collapse(Surface&, std::size_t triangles, Threads& threads, const std::function<void(std::size_t)>& tell = {});

}  // namespace kiln
