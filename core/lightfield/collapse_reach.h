#pragma once
// How far collapses have moved the surface, so that none takes it farther than it may go.
//
// Every point of the input keeps its place and hangs on a triangle. A collapse hangs those of the triangles that it
// changes on the nearest of the new ones, and is refused where one of them would be too far away. The other way round
//   reach(p) <- max(reach(gone), reach(kept)) + distance of the new vertex from the old triangles
// must not exceed it either.
// Units   max_reach is a share of the diagonal of the box of a connected piece, so a small thing in a large room keeps
//         its shape as well as the room does
// Error   none for the vertices of the input: each lies within its reach of the result. Vertices of the result were
//         1.11 times as far from the input at most (its test): insides of triangles move beyond their corners
// Cost    points of a patch x its triangles for each collapse; 20 bytes a point
// Repeat  same bits always

#include <utility>
#include <vector>

#include "core/lightfield/collapse_cost.h"
#include "core/lightfield/collapse_mesh.h"

namespace kiln {

class CollapseReach {
 public:
  /// Infinite `max_reach`: all is allowed, and nothing is kept.
  CollapseReach(const CollapseMesh&, double max_reach);

  bool allows(const CollapsePlan&);
  /// Of the plan that allows() was asked last.
  void take(const CollapsePlan&);

 private:
  void hang(std::uint32_t point, std::uint32_t triangle);

  const CollapseMesh& mesh_;
  std::vector<Vec3f> place_;                                  // of points, as they were
  std::vector<float> most_, reach_;                           // of points
  std::vector<std::uint32_t> next_;                           // of points: the next one that hangs on the same triangle
  std::vector<std::uint32_t> head_;                           // of triangles: the first
  std::vector<std::uint32_t> old_;                            // triangles of the plan at hand,
  std::vector<std::pair<std::uint32_t, std::uint32_t>> new_;  // its points with the triangles that they move to,
  double reach_then_ = 0;                                     // and the reach of its vertex
};

}  // namespace kiln
