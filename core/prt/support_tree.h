#pragma once
// Does anything rise above a plane?  A point that nothing rises above sees the whole of its hemisphere.

#include <vector>

#include "core/base/vec.h"

namespace kiln {

/// Boxes over the vertices of a scene along the Morton curve. Exact: the boxes only prune.
/// Cost    32 bytes for 8 vertices beside their positions; a query visits few boxes unless the scene hugs the plane
class SupportTree {
 public:
  explicit SupportTree(const std::vector<Vec3f>& vertices);

  /// Whether some vertex has n . x > level.
  bool rises_above(const Vec3f& n, float level) const;

 private:
  struct Box {
    Vec3f low, high;
  };
  static constexpr std::size_t kLeaf = 8;
  bool leaf_rises(std::size_t leaf, const Vec3f& n, float level) const;

  std::vector<Vec3f> vertex_;  // in Morton order
  std::vector<Box> box_;       // heap: box 1 is all, children of b are 2b and 2b + 1, leaves come last
  std::size_t leaves_ = 0;     // a power of two
};

}  // namespace kiln
