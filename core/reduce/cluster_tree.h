#pragma once
// The octree above the cells of a clustering: cells are joined where the surface is flat. For clusters.cpp alone.

#include "core/reduce/cluster_cells.h"

namespace kiln::clustering {

/// Joins cells until at most `vertices` leaves are left, or nothing can be joined any more: those first whose joint
/// vertex adds least to the squared error per vertex saved. Adds a vertex for each leaf, in Morton order. The sums of
/// cells that are joined end up in the first one's place. Memory  about 60 bytes a cell.   Repeat  same bits always
Leaves join_leaves(Grid&, std::size_t vertices, Surface& out);

}  // namespace kiln::clustering
