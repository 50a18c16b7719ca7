#pragma once
// A bounding-volume hierarchy over the triangles of a mesh, for questions that no ray answers.
//
// Halved at the median centroid of the longest axis, equal centroids by index: the same tree always.
// Cost    build n log n, 40 bytes a triangle

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

struct Box {
  Vec3f low{HUGE_VALF, HUGE_VALF, HUGE_VALF}, high{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  void add(const Vec3f& p);
  int longest_axis() const;
  bool overlaps(const Box& other) const;
};

double squared_distance(const Box&, const Vec3d& point);
Box triangle_box(const Mesh&, const Triangle&);

/// Of its nodes the first is the root.
struct BoxTree {
  /// Leaf when count > 0: triangles order[first .. first + count). Else its children are nodes first and first + 1.
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;
  };

  explicit BoxTree(const Mesh&);

  /// Calls visit(triangle) for every triangle of a leaf whose box overlaps `box`.
  template <class Visit>
  void overlapping(const Box& box, const Visit& visit) const {
    if (nodes.empty()) return;
    std::array<std::uint32_t, kMostOpen> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node& node = nodes[stack[--top]];
      if (!node.box.overlaps(box)) continue;
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(order[i]);
      if (node.count > 0) continue;
      stack[top++] = node.first + 1;
      stack[top++] = node.first;
    }
  }

  static constexpr std::size_t kMostOpen = 128;  // two for each level; a median split has at most 32 levels
  std::vector<std::uint32_t> order;
  std::vector<Node> nodes;

 private:
  void split(const Mesh&, std::size_t node);
};

}  // namespace kiln
