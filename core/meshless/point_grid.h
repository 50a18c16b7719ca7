#pragma once
// Points in cells of a hashed grid: who is near, for points that come one by one.
// Units   unit-cube lengths; positions within [-1, 1]^3.   Cost   a look-up visits the cells that the ball's box meets.

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/index_table.h"
#include "core/base/random.h"
#include "core/base/vec.h"

namespace kiln {

class PointGrid {
 public:
  static constexpr float kSmallestCell = 4e-6F;  // 21 bits for each coordinate of a cell

  /// Best where most balls asked for are about as wide as a cell. Any positive size is right.
  explicit PointGrid(float cell) : per_cell_(1 / std::max(cell, kSmallestCell)) {}

  std::size_t size() const { return points_.size(); }
  void add(std::uint32_t id, const Vec3f& position);

  /// Calls f(id, squared distance) for every point at most `reach` from p, each once, in no particular order.
  template <class F>
  void near(const Vec3f& p, float reach, const F& f) const {
    const float most = reach * reach;
    const auto visit = [&](const Point& q) {
      const Vec3f d = q.position - p;
      if (const float d2 = dot(d, d); d2 <= most) f(q.id, d2);
    };
    const Cell low = cell_of({p.x - reach, p.y - reach, p.z - reach});
    const Cell high = cell_of({p.x + reach, p.y + reach, p.z + reach});
    const double boxes = (high.x - low.x + 1.0) * (high.y - low.y + 1.0) * (high.z - low.z + 1.0);
    if (boxes > static_cast<double>(points_.size())) {
      for (const Point& q : points_) visit(q);
      return;
    }
    for (std::int32_t z = low.z; z <= high.z; ++z) {
      for (std::int32_t y = low.y; y <= high.y; ++y) {
        for (std::int32_t x = low.x; x <= high.x; ++x) {
          for (std::uint32_t i = first_in({x, y, z}); i != kEnd; i = points_[i].next) visit(points_[i]);
        }
      }
    }
  }

 private:
  static constexpr std::uint32_t kEnd = 0xffffffffU;
  struct Cell {
    std::int32_t x, y, z;
  };
  struct Point {
    Vec3f position;
    std::uint32_t id, next;  // next in the same cell
  };
  struct Head {
    std::uint64_t key;
    std::uint32_t first;
  };

  Cell cell_of(const Vec3f& p) const {
    const auto index = [this](float x) {
      return static_cast<std::int32_t>(std::floor((std::min(std::max(x, -4.0F), 4.0F)) * per_cell_));
    };
    return {index(p.x), index(p.y), index(p.z)};
  }
  static std::uint64_t key_of(const Cell& c) {
    const auto bits = [](std::int32_t x) { return static_cast<std::uint64_t>(x + (1 << 20)) & 0x1fffffU; };
    return bits(c.x) << 42 | bits(c.y) << 21 | bits(c.z);
  }
  std::uint32_t first_in(const Cell& c) const {
    const std::uint64_t key = key_of(c);
    const std::uint32_t h = table_.find(mix64(key), [&](std::uint32_t i) { return heads_[i].key == key; });
    return h == IndexTable::kNone ? kEnd : heads_[h].first;
  }

  float per_cell_;
  IndexTable table_;
  std::vector<Head> heads_;
  std::vector<Point> points_;
};

}  // namespace kiln
