#pragma once
// A mesh cut along the lines where light jumps: the feet of what stands on it, and the edges of hard shadows.
//
// A triangle across such a line carries the light of one side to the other however small it is. So the mesh is cut
// before anything is baked (discontinuity meshing, Heckbert 1992, where light itself jumps), and the two sides get
// vertices of their own at the same places, as those of a seam.
// Crack-free  the points of an edge are those of all triangles that share it by position
// Bounded     never more triangles than the budget   Repeat  same bits for any thread count

#include <cstdint>
#include <span>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/cut_line.h"
#include "core/prt/subdivide.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Cuts along as many of the lines, in their order, as `budget` triangles allow. Vertices keep their indices; where
/// they are parted the first triangles around them keep them.
Mesh cut_along(const Mesh&, std::span<const CutLine>, std::uint64_t budget, Threads&);

/// Cuts a scene's mesh along contact lines and shadow lines: first along those across which the light of `source`
/// changes most over the most area; lines inside solids are left out.
Mesh cut_where_light_jumps(const Tracer&, const ValueSource& source, std::uint64_t budget, Threads&);

}  // namespace kiln
