#include "core/reduce/cluster_tree.h"

#include <queue>

namespace kiln::clustering {
namespace {

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

}  // namespace

Leaves join_leaves(Grid& grid, std::size_t vertices, Surface& out) {
  Joiner joiner(grid);
  joiner.join(vertices);
  return joiner.leaves(out);
}

}  // namespace kiln::clustering
