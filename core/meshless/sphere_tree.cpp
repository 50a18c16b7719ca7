#include "core/meshless/sphere_tree.h"

#include <algorithm>

#include "core/prt/morton.h"

namespace kiln {

SphereTree::SphereTree(std::span<const Ball> balls) {
  if (balls.empty()) return;
  std::vector<Vec3f> centers;
  for (const Ball& b : balls) centers.push_back(b.center);
  index_ = morton_order(centers);
  for (const std::uint32_t i : index_) items_.push_back(balls[i]);

  std::size_t leaves = 1;
  while (leaves * kLeaf < items_.size()) leaves *= 2;
  first_leaf_ = leaves - 1;
  boxes_.resize(2 * leaves - 1);
  const auto join = [](Box& box, const Vec3f& low, const Vec3f& high) {
    const bool empty = box.low.x > box.high.x;
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = empty ? low[k] : std::min(box.low[k], low[k]);
      box.high[k] = empty ? high[k] : std::max(box.high[k], high[k]);
    }
  };
  for (std::size_t i = 0; i < items_.size(); ++i) {
    const auto [c, r] = items_[i];
    join(boxes_[first_leaf_ + i / kLeaf], {c.x - r, c.y - r, c.z - r}, {c.x + r, c.y + r, c.z + r});
  }
  for (std::size_t node = first_leaf_; node-- > 0;) {
    for (const std::size_t child : {2 * node + 1, 2 * node + 2}) {
      if (boxes_[child].low.x <= boxes_[child].high.x) join(boxes_[node], boxes_[child].low, boxes_[child].high);
    }
  }
}

}  // namespace kiln
