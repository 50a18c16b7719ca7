#pragma once
// Cuts along contact lines.
//
// A triangle across such a line carries the light of one side to the other however small it is. So an edge that is
// pierced is cut where that happens, and what is left of the triangles on either side of the line gets vertices of its
// own there: light is continuous on each side. (Discontinuity meshing, Heckbert 1992, for contact lines only.)
// Crack-free  an edge is cut for all triangles that share it by position
// Bounded     never more triangles than the budget: edges along which light changes most, times their length, are cut
//             first
// Repeat      same bits for any thread count   Memory  about 70 bytes a vertex while it works

#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/hidden.h"
#include "core/prt/pierce.h"
#include "core/prt/split_mesh.h"

namespace kiln {

/// How much the light of two vertices differs.
using LightContrast = std::function<float(std::uint32_t a, std::uint32_t b)>;

/// Cuts the pierced edges of `closed`, and parts the vertices of edges that something stands on (part_vertices.h).
/// Returns the vertices that are new or parted with the points whose light they have; finding it (closed.point) is the
/// caller's.
std::vector<StandIn> cut_pierced(ClosedMesh& closed, const PierceTest&, const LightContrast&, std::uint64_t budget,
                                 Threads&);

}  // namespace kiln
