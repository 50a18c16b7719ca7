#include "core/reduce/clusters.h"

#include <algorithm>
#include <array>
#include <memory>
#include <queue>

#include "core/base/index_table.h"
#include "core/base/random.h"

namespace kiln {
namespace {

constexpr std::size_t kShards = 8, kBlock = 4096;
constexpr int kAxisBits = 20;
constexpr double kBorderWeight = 4;  // of squared lengths beside areas: borders move less than surfaces

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

std::uint64_t halved(std::uint64_t key) {
  constexpr std::uint64_t kAxis = (1ULL << kAxisBits) - 1;
  const auto half = [&](int shift) { return (key >> shift & kAxis) >> 1 << shift; };
  return half(2 * kAxisBits) | half(kAxisBits) | half(0);
}

/// Spreads the bits of a key so that cells near each other in the octree are near in order.
std::uint64_t morton(std::uint64_t key) {
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

std::size_t shard_of(std::uint64_t key) { return mix64(key) >> 61; }
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

/// Joins cells two by two by two.
void coarsen(Grid& grid) {
  std::array<Shard, kShards> old;
  old.swap(grid.shards);
  ++grid.lattice.level;
  for (Shard& from : old) {
    for (std::size_t i = 0; i < from.keys.size(); ++i) {
      const std::uint64_t key = halved(from.keys[i]);
      grid.shards[shard_of(key)].at(key) += from.cells[i];
    }
    from = {};
  }
}

/// What one triangle adds to the cell of a corner, or of all three.
struct Share {
  std::uint64_t key;
  std::uint32_t triangle;
  std::uint8_t shard, corner;  // 3: the whole triangle
};

struct Plane {
  Vec3d normal;
  double distance = 0, area = 0;
};

/// Pass 1 for one batch: shares are found in parallel, each shard then takes its own in order.
class Adder {
 public:
  Adder(Grid& grid, const UnitFrame& frame, Threads& threads) : grid_(grid), frame_(frame), threads_(threads) {}

  void add(const TriangleBatch& batch) {
    const std::size_t n = batch.triangles();
    unit_.resize(3 * n), planes_.resize(n), shares_.resize(3 * n), counts_.assign(n / kBlock + 1, 0);
    threads_.for_blocks(n, kBlock, [&](std::size_t begin, std::size_t end) {
      std::size_t at = 3 * begin;
      for (std::size_t t = begin; t < end; ++t) at = find_shares(batch, t, at);
      counts_[begin / kBlock] = at - 3 * begin;
    });
    threads_.for_blocks(kShards, 1, [&](std::size_t shard, std::size_t) {
      for (std::size_t block = 0; block < counts_.size(); ++block) {
        const Share* share = shares_.data() + 3 * block * kBlock;
        for (std::size_t i = 0; i < counts_[block]; ++i) {
          if (share[i].shard == shard) take(share[i], batch, grid_.shards[shard]);
        }
      }
    });
  }

 private:
  std::size_t find_shares(const TriangleBatch& batch, std::size_t t, std::size_t at) {
    Vec3d* p = &unit_[3 * t];
    std::array<std::uint64_t, 3> keys;
    for (std::size_t c = 0; c < 3; ++c) {
      p[c] = frame_.to_unit(batch.position[3 * t + c]);
      keys[c] = grid_.lattice.key(p[c]);
    }
    const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
    const double twice = length(n);
    planes_[t] = {twice > 0 ? n / twice : Vec3d{}, twice > 0 ? dot(n, p[0]) / twice : 0, 0.5 * twice};
    const auto share = [&](std::uint64_t key, int corner) {
      shares_[at++] = {key, static_cast<std::uint32_t>(t), static_cast<std::uint8_t>(shard_of(key)),
                       static_cast<std::uint8_t>(corner)};
    };
    if (keys[0] == keys[1] && keys[0] == keys[2]) {
      share(keys[0], 3);
    } else {
      for (int c = 0; c < 3; ++c) share(keys[static_cast<std::size_t>(c)], c);
    }
    return at;
  }

  void take(const Share& share, const TriangleBatch& batch, Shard& shard) const {
    constexpr double kSome = 1e-60;  // triangles without area count too, where there are no others
    Cell& cell = shard.at(share.key);
    const Plane& plane = planes_[share.triangle];
    const Vec3d* p = &unit_[3 * std::size_t{share.triangle}];
    const Vec3f* color = batch.color.empty() ? nullptr : &batch.color[3 * std::size_t{share.triangle}];
    const double third = plane.area / 3;
    if (share.corner == 3) {
      cell.quadric.add_plane(plane.normal, plane.distance, plane.area);
      cell.moment += plane.normal * (2 * plane.area);
      cell.sum += (p[0] + p[1] + p[2]) * (third + kSome);
      cell.weight += 3 * (third + kSome);
      if (color) cell.color += (color[0] + color[1] + color[2]) * static_cast<float>(third);
      return;
    }
    const std::size_t c = share.corner, before = (c + 2) % 3, after = (c + 1) % 3;
    cell.quadric.add_plane(plane.normal, plane.distance, third);
    cell.edge += (p[after] - p[before]) * 0.5;
    cell.moment += (cross(p[before], p[c]) + cross(p[c], p[after])) * 0.5;
    cell.sum += p[c] * (third + kSome);
    cell.weight += third + kSome;
    if (color) cell.color += color[c] * static_cast<float>(third);
  }

  Grid& grid_;
  const UnitFrame& frame_;
  Threads& threads_;
  std::vector<Vec3d> unit_;
  std::vector<Plane> planes_;
  std::vector<Share> shares_;
  std::vector<std::size_t> counts_;
};

/// A surface of area A meets about 1.7 A / h^2 cells of size h (1 where it is aligned, 1.5 on average over directions
/// of a plane; more where it is rough). Joining mends a wrong guess.
Lattice first_lattice(const Extent& extent, std::uint64_t cells) {
  const UnitFrame frame = extent.frame();
  const double area = extent.area / (frame.scale * frame.scale);
  const double size = std::sqrt(1.7 * std::max(area, 1e-6) / (0.7 * static_cast<double>(cells)));
  constexpr double kFinest = 1.0 / ((1 << kAxisBits) - 2);
  return {std::clamp(size, kFinest, 1.0)};
}

/// Which vertex each cell of a shard has become.
using Leaves = std::array<std::vector<std::uint32_t>, kShards>;

/// A leaf's vertex. It may leave its cell by a little, not more.
void add_vertex(Surface& out, const Cell& cell, double side) {
  const Vec3d mean = cell.mean();
  const Quadric q = cell.whole(side);
  const Vec3d best = least_point(q, mean);
  out.position.push_back(length(best - mean) < side ? best : mean);
  out.sample.push_back({q, cell.color, cell.weight});
}

Leaves uniform_leaves(const Grid& grid, Surface& out) {
  Leaves leaves;
  for (std::size_t s = 0; s < kShards; ++s) {
    for (const Cell& cell : grid.shards[s].cells) {
      leaves[s].push_back(static_cast<std::uint32_t>(out.position.size()));
      add_vertex(out, cell, grid.lattice.side());
    }
  }
  return leaves;
}

/// The octree above the cells. A node is a run of cells in Morton order and lives in the first one's place.
class Joiner {
 public:
  explicit Joiner(Grid& grid) : grid_(grid) {
    for (std::uint32_t s = 0; s < kShards; ++s) {
      for (std::uint32_t i = 0; i < grid.shards[s].keys.size(); ++i)
        order_.push_back({morton(grid.shards[s].keys[i]), s, i});
    }
    std::sort(order_.begin(), order_.end(), [](const Place& a, const Place& b) { return a.code < b.code; });
    levels_.push_back(bottom());
    while (levels_.size() <= kMostLevels && levels_.back().first.size() > 1) levels_.push_back(above(levels_.back()));
  }

  /// Joins until at most `vertices` leaves are left, or nothing can be joined any more.
  void join(std::size_t vertices) {
    std::size_t leaves = order_.size();
    for (std::uint32_t n = 0; levels_.size() > 1 && n < levels_[1].first.size(); ++n) consider(1, n);
    while (leaves > vertices && !queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      Level& level = levels_[next.level];
      const std::size_t children = level.end_child(next.node) - level.first_child[next.node];
      cell_at(level.first[next.node]) = joined(next.level, next.node);
      level.leaf[next.node] = true;
      leaves -= children - 1;
      if (std::size_t{next.level} + 1 == levels_.size()) continue;
      const std::uint32_t parent = level.parent[next.node];
      if (all_leaves(next.level + 1, parent)) consider(next.level + 1, parent);
    }
  }

  /// Vertices of the leaves, in Morton order.
  Leaves leaves(Surface& out) {
    Leaves result;
    for (std::size_t s = 0; s < kShards; ++s) result[s].resize(grid_.shards[s].keys.size());
    for (std::uint32_t at = 0; at < order_.size();) {
      std::size_t level = 0;
      std::uint32_t node = at;
      while (level + 1 < levels_.size() && levels_[level + 1].leaf[levels_[level].parent[node]])
        node = levels_[level++].parent[node];
      const std::uint32_t end = levels_[level].end(node, order_.size());
      const auto vertex = static_cast<std::uint32_t>(out.position.size());
      add_vertex(out, cell_at(at), grid_.lattice.side() * static_cast<double>(1 << level));
      for (; at < end; ++at) result[order_[at].shard][order_[at].index] = vertex;
    }
    return result;
  }

 private:
  static constexpr std::size_t kMostLevels = 6;  // a leaf is at most 64 cells along a side

  struct Place {
    std::uint64_t code;
    std::uint32_t shard, index;
  };
  struct Level {
    std::vector<std::uint32_t> first;        // cell, in order, of each node
    std::vector<std::uint32_t> first_child;  // node of the level below
    std::vector<std::uint32_t> parent;
    std::vector<bool> leaf;  // has been joined into one, or is a cell
    std::size_t children = 0;

    std::uint32_t end(std::uint32_t node, std::size_t cells) const {
      return node + 1 < first.size() ? first[node + 1] : static_cast<std::uint32_t>(cells);
    }
    std::uint32_t end_child(std::uint32_t node) const {
      return node + 1 < first_child.size() ? first_child[node + 1] : static_cast<std::uint32_t>(children);
    }
  };
  struct Candidate {
    double cost;
    std::uint32_t level, node;
    bool operator<(const Candidate& o) const {  // the cheapest first, then by place
      if (cost != o.cost) return cost > o.cost;
      return level != o.level ? level > o.level : node > o.node;
    }
  };

  Cell& cell_at(std::uint32_t at) { return grid_.shards[order_[at].shard].cells[order_[at].index]; }

  Level bottom() const {
    Level level;
    for (std::uint32_t i = 0; i < order_.size(); ++i) level.first.push_back(i);
    level.leaf.assign(order_.size(), true);
    return level;
  }
  Level above(Level& below) const {
    Level level;
    const std::size_t shift = 3 * levels_.size();
    below.parent.resize(below.first.size());
    for (std::uint32_t n = 0; n < below.first.size(); ++n) {
      const std::uint32_t cell = below.first[n];
      const bool fresh = level.first.empty() || order_[level.first.back()].code >> shift != order_[cell].code >> shift;
      if (fresh) level.first.push_back(cell), level.first_child.push_back(n);
      below.parent[n] = static_cast<std::uint32_t>(level.first.size() - 1);
    }
    level.children = below.first.size();
    level.leaf.assign(level.first.size(), false);
    return level;
  }
  bool all_leaves(std::uint32_t level, std::uint32_t node) const {
    const Level& l = levels_[level];
    for (std::uint32_t c = l.first_child[node]; c < l.end_child(node); ++c) {
      if (!levels_[level - 1].leaf[c]) return false;
    }
    return true;
  }
  Cell joined(std::uint32_t level, std::uint32_t node) {
    const Level& l = levels_[level];
    Cell sum;
    for (std::uint32_t c = l.first_child[node]; c < l.end_child(node); ++c) sum += cell_at(levels_[level - 1].first[c]);
    return sum;
  }
  double error(const Cell& cell, std::uint32_t level) const {
    const double side = grid_.lattice.side() * static_cast<double>(1 << level);
    const Quadric q = cell.whole(side);
    return q.at(least_point(q, cell.mean()));
  }
  void consider(std::uint32_t level, std::uint32_t node) {
    const Level& l = levels_[level];
    double apart = 0;
    for (std::uint32_t c = l.first_child[node]; c < l.end_child(node); ++c)
      apart += error(cell_at(levels_[level - 1].first[c]), level - 1);
    const auto saved = static_cast<double>(l.end_child(node) - l.first_child[node] - 1);
    const double more = std::max(0.0, error(joined(level, node), level) - apart);
    queue_.push({saved > 0 ? more / saved : 0, level, node});
  }

  Grid& grid_;
  std::vector<Place> order_;
  std::vector<Level> levels_;
  std::priority_queue<Candidate> queue_;
};

/// Triangles without repetition: turned so that their smallest corner comes first.
class TriangleSet {
 public:
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (b < a && b < c) std::swap(a, b), std::swap(b, c);  // (b, c, a)
    if (c < a && c < b) std::swap(a, c), std::swap(b, c);  // (c, a, b)
    const Triangle t{a, b, c};
    if (table_.find(hash(t), [&](std::uint32_t i) { return triangles[i] == t; }) != IndexTable::kNone) return;
    triangles.push_back(t);
    table_.add(static_cast<std::uint32_t>(triangles.size() - 1), [&](std::uint32_t i) { return hash(triangles[i]); });
  }
  std::vector<Triangle> triangles;

 private:
  static std::uint64_t hash(const Triangle& t) { return mix64(mix64(std::uint64_t{t[0]} << 32 | t[1]) ^ t[2]); }
  IndexTable table_;
};

/// Pass 2.
Result<std::vector<Triangle>> connect(const TriangleSource& source, const Grid& grid, const Leaves& leaves,
                                      const UnitFrame& frame, Threads& threads) {
  TriangleSet set;
  std::vector<Triangle> found;
  std::vector<std::size_t> counts;
  const auto leaf = [&](const Vec3d& world) {
    const std::uint64_t key = grid.lattice.key(frame.to_unit(world));
    const std::size_t shard = shard_of(key);
    const std::uint32_t i = grid.shards[shard].find(key);
    return i == IndexTable::kNone ? i : leaves[shard][i];  // only where a file has changed under us
  };
  const auto take = [&](const TriangleBatch& batch) {
    const std::size_t n = batch.triangles();
    found.resize(n), counts.assign(n / kBlock + 1, 0);
    threads.for_blocks(n, kBlock, [&](std::size_t begin, std::size_t end) {
      std::size_t& count = counts[begin / kBlock];
      for (std::size_t t = begin; t < end; ++t) {
        const Vec3d* p = &batch.position[3 * t];
        const std::uint32_t a = leaf(p[0]), b = leaf(p[1]), c = leaf(p[2]);
        if (a != b && b != c && c != a && std::max({a, b, c}) != IndexTable::kNone) found[begin + count++] = {a, b, c};
      }
    });
    for (std::size_t block = 0; block < counts.size(); ++block) {
      for (std::size_t i = 0; i < counts[block]; ++i) {
        const Triangle& t = found[block * kBlock + i];
        set.add(t[0], t[1], t[2]);
      }
    }
  };
  if (auto done = source.stream(Detail::positions, take, threads); !done) return tl::make_unexpected(done.error());
  return std::move(set.triangles);
}

}  // namespace

Result<Surface> cluster(const TriangleSource& source, const Extent& extent, const Clustering& params,
                        Threads& threads) {
  const UnitFrame frame = extent.frame();
  const auto grid = std::make_unique<Grid>();
  grid->lattice = first_lattice(extent, params.cells);
  grid->reserve(params.cells);
  Adder adder(*grid, frame, threads);
  const auto take = [&](const TriangleBatch& batch) {
    adder.add(batch);
    while (grid->size() > params.cells && grid->lattice.level < kAxisBits) coarsen(*grid);
  };
  const Detail detail = source.colors ? Detail::all : Detail::positions;
  if (auto done = source.stream(detail, take, threads); !done) return tl::make_unexpected(done.error());
  Surface out;
  Leaves leaves;
  if (params.vertices > 0 && params.vertices < grid->size()) {
    Joiner joiner(*grid);
    joiner.join(params.vertices);
    leaves = joiner.leaves(out);
  } else {
    leaves = uniform_leaves(*grid, out);
  }
  for (Shard& shard : grid->shards) shard.cells = {};
  KILN_TRY(triangles, connect(source, *grid, leaves, frame, threads));
  out.triangles = std::move(triangles);
  drop_unused(out);
  return out;
}

}  // namespace kiln
