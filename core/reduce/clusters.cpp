#include "core/reduce/clusters.h"

#include <algorithm>
#include <array>
#include <memory>

#include "core/reduce/cluster_tree.h"

namespace kiln {
namespace {

using namespace clustering;

constexpr std::size_t kBlock = 4096;

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
    leaves = join_leaves(*grid, params.vertices, out);
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
