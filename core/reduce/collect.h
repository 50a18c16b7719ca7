#pragma once
// A model that fits into memory, as a surface.

#include "core/reduce/measure.h"
#include "core/reduce/surface.h"
#include "core/reduce/triangle_source.h"

namespace kiln {

/// Bytes of a triangle while it is collected and collapsed: half a vertex, its sample, its place in the queue.
inline constexpr std::uint64_t kCollectedBytes = 220;

/// All triangles, corners at bit-equal places joined; degenerate and repeated ones are left out. Samples hold the
/// planes of the triangles around, a third each, and the lines along borders. Memory  kCollectedBytes a triangle,
/// collapse() included.   Repeat  same bits always.   Fails  as the source does
Result<Surface> collect(const TriangleSource&, const Extent&, Threads&);

}  // namespace kiln
