#pragma once
// Which corners of its cell a place may look at, found once with shadow rays so that a viewer needs none.
//
// Surfaces  Points are spread over every triangle (kPerCell to a cell's face, kPerBusy in cells where they differ or
// lie
//           along two axes, at least one), on the sides that show. Each asks for the corners it sees, and its normal
//           says which of six directions it votes for (corner_votes.h).
// Slivers   Places that see no corner of their cell look into a neighbour (corners_beyond.h).
// Rooms     In cells that a triangle passes through, the middle of each eighth asks. All corners count elsewhere.
// Beats     plane tests (shared notes, measured); a ray for every look-up is the truth it is tested against.
// Cost      8 rays for each point; 64 for each cell that a surface passes through
// Repeat    same bits for any thread count

#include <vector>

#include "core/base/threads.h"
#include "core/grid/grid.h"
#include "core/trace/tracer.h"

namespace kiln {

/// `lattice` in the unit cube; `stands` is where each of its vertices gathered (gather_places).
std::vector<CellCorners> find_cell_corners(const Tracer&, const Lattice& lattice, const std::vector<Vec3f>& stands,
                                           std::uint64_t& rays, Threads&);

/// The cells that a triangle of the mesh passes through, or nearly so.
std::vector<bool> cells_with_surface(const Mesh&, const Lattice&);

/// The corners of a cell that can be seen from a place: a ray to each. The slow truth of the above.
std::uint8_t corners_seen(const Tracer&, const Lattice&, const std::vector<Vec3f>& stands, const CellPlace&,
                          const Vec3f& from);

}  // namespace kiln
