#include "core/prt/support_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <utility>

#include "core/prt/morton.h"

namespace kiln {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Vec3f min(const Vec3f& a, const Vec3f& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3f max(const Vec3f& a, const Vec3f& b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

}  // namespace

SupportTree::SupportTree(const std::vector<Vec3f>& vertices) {
  for (const std::uint32_t v : morton_order(vertices)) vertex_.push_back(vertices[v]);
  leaves_ = std::bit_ceil(std::max<std::size_t>(1, (vertex_.size() + kLeaf - 1) / kLeaf));
  box_.assign(2 * leaves_, {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}});
  for (std::size_t v = 0; v < vertex_.size(); ++v) {
    Box& box = box_[leaves_ + v / kLeaf];
    box = {min(box.low, vertex_[v]), max(box.high, vertex_[v])};
  }
  for (std::size_t b = leaves_ - 1; b > 0; --b) {
    box_[b] = {min(box_[2 * b].low, box_[2 * b + 1].low), max(box_[2 * b].high, box_[2 * b + 1].high)};
  }
}

bool SupportTree::leaf_rises(std::size_t leaf, const Vec3f& n, float level) const {
  const std::size_t end = std::min(vertex_.size(), (leaf + 1) * kLeaf);
  for (std::size_t v = leaf * kLeaf; v < end; ++v) {
    if (dot(n, vertex_[v]) > level) return true;
  }
  return false;
}

bool SupportTree::rises_above(const Vec3f& n, float level) const {
  // The highest point of a box along n; empty boxes lie at minus infinity.
  const auto top = [&](std::size_t b) {
    const auto& [low, high] = box_[b];
    if (low.x > high.x) return -kInfinity;
    return std::max(n.x * low.x, n.x * high.x) + std::max(n.y * low.y, n.y * high.y) +
           std::max(n.z * low.z, n.z * high.z);
  };
  std::array<std::size_t, 64> stack;
  std::size_t size = 0;
  if (top(1) > level) stack[size++] = 1;
  while (size > 0) {
    const std::size_t b = stack[--size];
    if (b >= leaves_) {
      if (leaf_rises(b - leaves_, n, level)) return true;
      continue;
    }
    std::size_t near = 2 * b, far = 2 * b + 1;  // the higher one first: most often it settles the question
    float near_top = top(near), far_top = top(far);
    if (near_top < far_top) std::swap(near, far), std::swap(near_top, far_top);
    if (far_top > level) stack[size++] = far;
    if (near_top > level) stack[size++] = near;
  }
  return false;
}

}  // namespace kiln
