#pragma once
// Whether an input has more triangles than its shape needs, before any light is known.
//
// A chord of length L over a surface of curvature k lies k L^2 / 8 off it. So within a distance d a triangle may have
// the area sqrt(3) / 4 L1 L2, L^2 = 8 d / k for the most and the least curvature along its edges, and the shape needs
//   sum over triangles of min(1, area / area allowed)
// of them. Curvature is that of normals which are averaged at each position, whatever the shading. Triangles at an edge
// whose sides are shaded apart by more than a degree stay: facets would be seen to move.
// Error   within a factor of two of what merging leaves on smooth scans (README.md); light may need more

#include <algorithm>
#include <cstdint>

#include "core/mesh/mesh.h"

namespace kiln {

/// What merging may cost (merge_step.h), and what it is expected to leave.
struct MergePlan {
  double max_error = 0;         // relRMSE that it may add, by its own estimate
  double max_reach = 0;         // how far the surface may move, in parts of the diagonal of a connected piece
  std::uint64_t triangles = 0;  // expected
  std::uint64_t added = 0;      // by splits afterwards; 0: the recipe says how many there may be in the end
};

/// The budget of splits that follow: never more than half of what merging took comes back.
inline std::uint64_t budget_after(const MergePlan& merge, std::uint64_t merged, std::uint64_t input) {
  return merged + std::min(merge.added, (input - std::min(merged, input)) / 2);
}

/// What is left where light counts too. On the bunny and on hills it was 5 to 22 times as many as the shape alone
/// needs: the fewer rays, the more, since what they do not tell from noise stays.
inline std::uint64_t triangles_for_light(std::uint64_t shape) { return 6 * shape; }

/// Triangles that the shape needs within `max_reach`, at least two a mesh that has any.
std::uint64_t triangles_for_shape(const Mesh&, double max_reach);

}  // namespace kiln
