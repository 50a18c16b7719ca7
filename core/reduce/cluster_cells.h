#pragma once
// The cells of clusters.cpp and what they hold. For clusters.cpp and cluster_tree.cpp alone.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/index_table.h"
#include "core/base/random.h"
#include "core/reduce/surface.h"

namespace kiln::clustering {

inline constexpr std::size_t kShards = 8;
inline constexpr int kAxisBits = 20;

struct Cell {
  Quadric quadric;
  Vec3d edge, moment;  // E
  Vec3d sum;           // of corners, weighted by area
  double weight = 0;
  Vec3f color;

  Cell& operator+=(const Cell& o) {
    quadric += o.quadric;
    edge += o.edge, moment += o.moment, sum += o.sum;
    weight += o.weight;
    color += o.color;
    return *this;
  }
  Vec3d mean() const { return sum / weight; }
  /// Planes and border together. What rounding leaves of edges that cancel is far below a hundredth of a cell.
  Quadric whole(double cell_size) const {
    Quadric q = quadric;
    if (length(edge) > 0.01 * cell_size) q.add_line(edge, moment, kBorderWeight);
    return q;
  }
};

/// Cells of one size over the unit cube, by number.
struct Lattice {
  double size;    // of a cell, unit lengths
  int level = 0;  // cells of `size` are 2^level along a side

  std::uint64_t key(const Vec3d& unit) const {
    const auto along = [&](double x) {
      const auto i = static_cast<std::int64_t>(std::floor((x + 0.5) / size));
      return static_cast<std::uint64_t>(std::clamp<std::int64_t>(i, 0, (1 << kAxisBits) - 1)) >> level;
    };
    return along(unit.x) << (2 * kAxisBits) | along(unit.y) << kAxisBits | along(unit.z);
  }
  double side() const { return size * static_cast<double>(1 << level); }
};

inline std::uint64_t halved(std::uint64_t key) {
  constexpr std::uint64_t kAxis = (1ULL << kAxisBits) - 1;
  const auto half = [&](int shift) { return (key >> shift & kAxis) >> 1 << shift; };
  return half(2 * kAxisBits) | half(kAxisBits) | half(0);
}

/// Spreads the bits of a key so that cells near each other in the octree are near in order.
inline std::uint64_t morton(std::uint64_t key) {
  constexpr std::uint64_t kAxis = (1ULL << kAxisBits) - 1;
  std::uint64_t out = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::uint64_t x = key >> (axis * kAxisBits) & kAxis;
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    x = (x | x << 2) & 0x1249249249249249;
    out |= x << axis;
  }
  return out;
}

inline std::size_t shard_of(std::uint64_t key) { return mix64(key) >> 61; }
static_assert(kShards == 8);

/// One part of the cells: those whose key hashes into it.
struct Shard {
  std::vector<std::uint64_t> keys;
  std::vector<Cell> cells;
  IndexTable table;

  std::uint32_t find(std::uint64_t key) const {
    return table.find(mix64(key), [&](std::uint32_t i) { return keys[i] == key; });
  }
  Cell& at(std::uint64_t key) {
    std::uint32_t i = find(key);
    if (i == IndexTable::kNone) {
      i = static_cast<std::uint32_t>(keys.size());
      keys.push_back(key);
      cells.emplace_back();
      table.add(i, [&](std::uint32_t k) { return mix64(keys[k]); });
    }
    return cells[i];
  }
};

struct Grid {
  Lattice lattice{1};
  std::array<Shard, kShards> shards;

  std::size_t size() const {
    std::size_t n = 0;
    for (const Shard& s : shards) n += s.keys.size();
    return n;
  }
  void reserve(std::uint64_t cells) {
    const std::size_t each = cells / kShards * 51 / 50 + 64;  // hashing spreads them to a hundredth
    for (Shard& s : shards) s.keys.reserve(each), s.cells.reserve(each);
  }
};

/// Which vertex each cell of a shard has become.
using Leaves = std::array<std::vector<std::uint32_t>, kShards>;

/// A leaf's vertex. It may leave its cell by a little, not more.
inline void add_vertex(Surface& out, const Cell& cell, double side) {
  const Vec3d mean = cell.mean();
  const Quadric q = cell.whole(side);
  const Vec3d best = least_point(q, mean);
  out.position.push_back(length(best - mean) < side ? best : mean);
  out.sample.push_back({q, cell.color, cell.weight});
}

}  // namespace kiln::clustering
