#pragma once
// Adaptive subdivision: vertices where transferred light changes.
// Paper   Krivanek, Pattanaik, Zara 2004: figure 2 (loop), figure 3 (splits), eqs. 2-4 (measures).
// Beyond  `residual` knows values halfway along the edges; they make the vertices better (fit_vertices.h).
// Memory  at order 6 about 600 bytes a final vertex besides the mesh: rows of vertices and edge middles (row_store.h)
// Hidden  a vertex inside a solid that is beside a seen one stands for the last place that is seen (hidden.h)
// Error   rows are kept in 16 bits: 2^-13 of the largest of four neighbouring columns

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/hidden.h"
#include "core/prt/transfer_point.h"

namespace kiln {

inline constexpr int kMaxSplitDepth = 16;

enum class SplitMeasure { residual, eq2, eq3, eq4 };

struct Subdivide {
  SplitMeasure measure = SplitMeasure::residual;
  float alpha = 1;              // eq. 4: weight of normal divergence, per radian
  float threshold = 0;          // split while the measure is above; unit of the measure
  std::uint64_t triangles = 0;  // budget of the final mesh; 0: the input's count (no split)
  int max_depth = 8;            // 1:4 splits of one input triangle, 0..kMaxSplitDepth
};

struct Subdivided {
  Mesh mesh;                        // no T-vertex, no crack; part ids kept; all attributes interpolated
  std::vector<float> values;        // values[v * width + i] for its vertices; as sampled, or fitted (residual)
  std::vector<std::uint8_t> depth;  // of each triangle: how often its input triangle was split
  std::uint64_t evaluated = 0;      // points at which the source was called; each point once
  std::vector<StandIn> stand_ins;   // of hidden vertices, where their values are from; ascending
};

/// What is wanted at points: a transfer vector, and the light of lamps.
struct ValueSource {
  std::size_t width = 0;  // numbers of a point
  /// width numbers of each point; called with thousands of points at once.
  std::function<std::vector<float>(std::span<const TransferPoint>)> values;
  std::vector<std::size_t> bounded = {};  // columns that no vertex may have outside the range sampled around it
  HiddenTest hidden = {};                 // none: everything is seen
  /// The same, rougher: for points that only tell where to split. None: `values`.
  std::function<std::vector<float>(std::span<const TransferPoint>)> rough = {};
};

Subdivided subdivide(const Mesh&, const ValueSource&, const Subdivide&, Threads&);

}  // namespace kiln
