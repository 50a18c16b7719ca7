#pragma once
// Finer bricks where a grid is wrong at surfaces.
//   e^2 = (a - g)(b - g) at places all over the surface: g is what the grid reads, a and b what two independent
//   gathers receive there, so that noise of neither counts in the mean                                             (1)
// Places   even over the surface on the side of the vertex normals, kPerFace to a cell's face of the lattice that
//          answers for them, each weighted by the area it stands for; those inside solids are left out.
// Bricks   of the next finer lattice, twice as fine as the one that answered. Those of the largest sums of e^2 first,
//          until what is left elsewhere is below kLeft of the square that is asked for, or `most_vertices` are.
// Depth    at most most_finer lattices beyond the base.
// Repeat   same bits for any thread count.   Fails  never; Cancelled if stopped

#include <cstdint>

#include "core/base/threads.h"
#include "core/grid/bake_grid.h"

namespace kiln {

struct GridRefinement {
  double error = 0.05;                               // relRMSE that is asked for
  std::size_t most_vertices = std::size_t{1} << 22;  // of all lattices together
  std::size_t most_finer = 6;                        // lattices beyond the base
};

/// Where bricks are asked for: blocks of the lattices beyond the base, ascending.
struct BricksWanted {
  std::vector<std::vector<std::uint32_t>> blocks;  // [lattice of Grid::finer]
  std::size_t fresh = 0;                           // blocks that are not stored yet
  double error = 0;                                // relRMSE at the places, by equation 1
  std::uint64_t rays = 0;
};
BricksWanted find_bricks(const SphereGather::World&, const GridBake&, const GridRefinement&, const Grid&, Threads&);

/// Bakes the lattices of `wanted` that have bricks the grid has not. Adds to the statistics.
void add_bricks(const SphereGather::World&, const GridBake&, const BricksWanted&, BakedGrid&, Threads&);

}  // namespace kiln
