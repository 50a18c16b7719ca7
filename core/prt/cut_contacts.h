#pragma once
// A mesh cut along contact lines.
//
// A triangle across such a line carries the light of one side to the other however small it is. So the mesh is cut
// before anything is baked (discontinuity meshing, Heckbert 1992, for contact lines only), and the two sides get
// vertices of their own at the same places, as those of a seam.
// Crack-free  the points of an edge are those of all triangles that share it by position
// Bounded     never more triangles than the budget   Repeat  same bits for any thread count

#include <cstdint>
#include <span>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/contact_lines.h"
#include "core/prt/subdivide.h"
#include "core/scene/scene.h"

namespace kiln {

/// Cuts along as many of the lines, in their order, as `budget` triangles allow. Vertices keep their indices; where
/// they are parted the first triangles around them keep them.
Mesh cut_contacts(const Mesh&, std::span<const ContactLine>, std::uint64_t budget, Threads&);

/// Cuts a scene's mesh where opaque surfaces stand on it: first along the lines across which the light of `source`
/// changes most over the most area. Where it does not change there is no cut.
Mesh cut_where_light_jumps(const Scene&, const ValueSource& source, std::uint64_t budget, Threads&);

}  // namespace kiln
