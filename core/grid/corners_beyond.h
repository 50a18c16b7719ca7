#pragma once
// Places that see no corner of their cell: slivers between a wall and the vertices beyond it.

#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/grid/corner_votes.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Where no place of a group sees a corner of its cell, they vote again on those of the neighbour they see the most:
/// a sliver may lie on both sides of another wall. Sides that still see none look into a neighbour of their own.
void look_beyond(const Tracer&, const Lattice&, const std::vector<Vec3f>& stands, std::span<const CornerVote>,
                 CornerCut&, std::uint64_t& rays);

/// A surface may only graze a cell, and no place of it vote there: the nearest neighbour in which places of that
/// direction voted stands in. `crossed` as cells_with_surface.
void fill_grazed(const Lattice&, const std::vector<bool>& crossed, std::vector<CellCorners>&, Threads&);

}  // namespace kiln
