#pragma once
// Out-of-core vertex clustering: all corners inside a cell become one vertex, where their planes ask for it.
//
//   pass 1   every triangle adds its plane, weighted by a third of its area, to the cells of its corners       (Q)
//            and every directed edge half of itself, e and a x b, to the cells of its ends                     (E)
//   pass 2   a triangle whose corners are in three different cells is a triangle of the result
//
// The edges of neighbouring triangles run in opposite directions and cancel exactly: what is left of E is the border
// that passes through the cell, and |e x p + m|^2 keeps the vertex on it. Cells are held in a table of fixed capacity;
// when it is full, neighbouring cells are joined two by two by two, so the table's memory is the only bound on the
// model.
//
// Adaptive: cells are the leaves of an octree. They are joined greedily, those first whose joint vertex adds least to
// the squared error per vertex saved, until `vertices` are left: fine where curved, coarse where flat.
//
// Paper    [Lindstrom00] (quadrics, two passes of the triangles); [LindstromSilva01] (borders that cancel);
//          [Boubekeur06] volume-surface trees (octree with a local error; ours joins upwards, its splits downwards)
// Memory   kCellBytes for each cell of the capacity, 16 MB of batches
// Cost     O(triangles) table look-ups a pass; O(cells log cells) to join
// Error    Q of the leaves; see core/reduce/README.md for what it comes to
// Repeat   same bits for any thread count: a cell is added to in the file's order
// Fails    as the source does

#include "core/reduce/measure.h"
#include "core/reduce/surface.h"
#include "core/reduce/triangle_source.h"

namespace kiln {

struct Clustering {
  std::uint64_t cells = 100'000;  // capacity; also how many uniform cells are aimed at
  std::uint64_t vertices = 0;     // adaptive: leaves that are left; 0: the uniform cells as they are
};

/// Bytes of a cell in its table, with all that stands beside it while cells are joined.
inline constexpr std::uint64_t kCellBytes = 280;

Result<Surface> cluster(const TriangleSource&, const Extent&, const Clustering&, Threads&);

}  // namespace kiln
