#pragma once
// Which balls hold a point: a flat bounding-volume hierarchy over spheres of different size.
// Balls lie along the Morton curve, eight to a leaf; nodes are a complete binary tree in one array (children of i are
// 2i + 1 and 2i + 2), so there is nothing to follow but indices.
// Cost    build n log n, about 20 bytes a ball beside the nodes' 6 bytes; a look-up is about 2 log2(n / 8) boxes
// Repeat  a pure function of the balls

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

struct Ball {
  Vec3f center;
  float radius = 0;
};

class SphereTree {
 public:
  SphereTree() = default;
  explicit SphereTree(std::span<const Ball>);

  /// Calls f(index, squared distance) for each ball with |p - center| < radius, in an order that depends on the balls
  /// alone.
  template <class F>
  void containing(const Vec3f& p, const F& f) const {
    if (boxes_.empty()) return;
    std::array<std::uint32_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const std::uint32_t node = stack[--depth];
      if (!boxes_[node].holds(p)) continue;
      if (node < first_leaf_) {
        stack[depth++] = 2 * node + 2;
        stack[depth++] = 2 * node + 1;
        continue;
      }
      const std::size_t first = (node - first_leaf_) * kLeaf, last = std::min(first + kLeaf, items_.size());
      for (std::size_t i = first; i < last; ++i) {
        const Vec3f d = items_[i].center - p;
        if (const float d2 = dot(d, d); d2 < items_[i].radius * items_[i].radius) f(index_[i], d2);
      }
    }
  }

 private:
  static constexpr std::size_t kLeaf = 8;
  struct Box {
    Vec3f low{1, 1, 1}, high{-1, -1, -1};  // empty
    bool holds(const Vec3f& p) const {
      return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && p.z >= low.z && p.z <= high.z;
    }
  };
  std::vector<Box> boxes_;
  std::vector<Ball> items_;  // along the curve
  std::vector<std::uint32_t> index_;
  std::size_t first_leaf_ = 0;
};

}  // namespace kiln
