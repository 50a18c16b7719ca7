#include "core/meshless/point_grid.h"

namespace kiln {

void PointGrid::add(std::uint32_t id, const Vec3f& position) {
  const std::uint64_t key = key_of(cell_of(position)), hash = mix64(key);
  std::uint32_t h = table_.find(hash, [&](std::uint32_t i) { return heads_[i].key == key; });
  if (h == IndexTable::kNone) {
    h = static_cast<std::uint32_t>(heads_.size());
    heads_.push_back({key, kEnd});
    table_.add(h, [&](std::uint32_t i) { return mix64(heads_[i].key); });
  }
  points_.push_back({position, id, heads_[h].first});
  heads_[h].first = static_cast<std::uint32_t>(points_.size() - 1);
}

}  // namespace kiln
