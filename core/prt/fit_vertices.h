#pragma once
// Vertex values that interpolate best, from the values that subdivision knows anyway.
//
// A value sampled at a vertex is right there and wrong in between: interpolation overshoots convex light and carries
// the noise of one point over the whole ring. What was sampled halfway along the edges that did not split costs nothing
// more:
//   minimise  sum over triangles of  A ( 1/20 sum_v |x_v - y_v|^2 + 17/60 sum_e |(x_a + x_b) / 2 - y_e|^2 )
// Paper   Kavan, Bargteil, Sloan 2011, least squares vertex baking.   Differs  samples are vertices and edge middles.
// Bounded Where a column of the caller's choice would leave the range of what was sampled at and around the vertex, the
//         whole row moves back towards its sample: no light below 0, no open point above 1.
// Seams   vertices of one place, normal and (nearly) value are one unknown: no seam becomes visible.
// Cost    about ten sweeps over vertices and edges for each four columns   Repeat  same bits for any thread count
// Memory  rows go as results come; 64 bytes a vertex and thread beside them
// Error   relRMSE falls by a quarter to a third at equal triangles (core/prt/README.md)

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/row_store.h"
#include "core/prt/split_mesh.h"

namespace kiln {

/// Values of the vertices of `closed`, rows.width() of each. `bounded` are columns. Uses up the rows.
std::vector<float> fit_vertices(const ClosedMesh& closed, RowStore rows, std::span<const std::size_t> bounded,
                                Threads&);

}  // namespace kiln
