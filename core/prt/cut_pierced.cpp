#include "core/prt/cut_pierced.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <tuple>
#include <utility>

#include "core/mesh/midpoint.h"
#include "core/mesh/topology.h"
#include "core/prt/part_vertices.h"
#include "core/prt/split_closure.h"

namespace kiln {
namespace {

/// One edge in space: between welded places p < q, as one triangle has it.
struct Side {
  std::uint32_t p, q;  // places
  std::uint32_t a, b;  // vertices there
  std::uint32_t triangle;
};

/// All sides of one edge that will be cut.
struct Cut {
  std::vector<Side> sides;  // by vertices
  Pierced pierced;
  float worth = 0;  // change of light times length
};

/// Calls f(side) for the edges of a triangle.
template <class F>
void for_sides(const Mesh& mesh, const std::vector<std::uint32_t>& place, std::uint32_t triangle, const F& f) {
  const Triangle& t = mesh.triangles[triangle];
  for (std::size_t k = 0; k < 3; ++k) {
    std::uint32_t a = t[k], b = t[(k + 1) % 3];
    if (place[a] > place[b]) std::swap(a, b);
    if (place[a] != place[b]) f(Side{place[a], place[b], a, b, triangle});
  }
}

/// The edges that can be cut, each with what the first of its triangles says.
std::vector<Cut> find_cuts(const Mesh& mesh, const PierceTest& test, const LightContrast& contrast, Threads& threads) {
  constexpr std::size_t kBlock = 1024;
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  std::vector<std::vector<std::pair<Side, Pierced>>> of_block(mesh.triangles.size() / kBlock + 1);
  threads.for_blocks(mesh.triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      for_sides(mesh, place, static_cast<std::uint32_t>(t), [&](const Side& s) {
        if (const auto pierced = cut_of_edge(mesh, mesh.triangles[t], s.a, s.b, test))
          of_block[begin / kBlock].emplace_back(s, *pierced);
      });
    }
  });
  std::vector<Cut> cuts;
  const auto key = [](const Cut& c) { return std::pair(c.sides[0].p, c.sides[0].q); };
  for (const auto& block : of_block) {
    for (const auto& [s, pierced] : block)
      cuts.push_back({{s}, pierced, contrast(s.a, s.b) * length(mesh.position[s.b] - mesh.position[s.a])});
  }
  std::ranges::stable_sort(cuts, {}, key);
  const auto same = [&](const Cut& c, const Cut& d) { return key(c) == key(d); };
  cuts.erase(std::unique(cuts.begin(), cuts.end(), same), cuts.end());

  std::vector<std::vector<Side>> all(cuts.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for_sides(mesh, place, t, [&](const Side& s) {
      const auto at = std::ranges::lower_bound(cuts, std::pair(s.p, s.q), {}, key);
      if (at != cuts.end() && key(*at) == std::pair(s.p, s.q))
        all[static_cast<std::size_t>(at - cuts.begin())].push_back(s);
    });
  }
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    std::ranges::sort(all[i], {}, [](const Side& s) { return std::tuple(s.a, s.b, s.triangle); });
    cuts[i].sides = std::move(all[i]);
  }
  return cuts;
}

/// Each side of a cut edge is one more triangle: the worthiest are kept, as many as fit.
void keep_worthiest(std::vector<Cut>& cuts, std::uint64_t room) {
  std::ranges::stable_sort(cuts, std::greater{}, &Cut::worth);
  std::uint64_t used = 0;
  std::erase_if(cuts, [&](const Cut& c) {
    const std::uint64_t more = c.sides.size();
    if (used + more > room) return true;
    used += more;
    return false;
  });
}

/// The two vertices where an edge between vertices a < b is cut: the last of a's side and the last of b's.
struct CutEdge {
  std::uint32_t a, b, near_a, near_b;
};

class Cutter {
 public:
  Cutter(ClosedMesh& closed, const std::vector<Cut>& cuts) : closed_(closed) {
    for (const Cut& cut : cuts) {
      for (std::size_t i = 0; i < cut.sides.size(); ++i) {
        const Side& s = cut.sides[i];
        const bool known = i > 0 && s.a == cut.sides[i - 1].a && s.b == cut.sides[i - 1].b;
        if (!known) add_vertices(s, cut.pierced);
      }
    }
    std::ranges::sort(edges_, {}, [](const CutEdge& e) { return std::pair(e.a, e.b); });
  }

  std::vector<StandIn> run() {
    ClosedMesh& c = closed_;
    const std::vector<Triangle> whole = std::exchange(c.mesh.triangles, {});
    const std::vector<std::uint32_t> part = std::exchange(c.mesh.part, {});
    const std::vector<std::uint8_t> depth = std::exchange(c.depth, {});
    const std::size_t triangles = whole.size() + 2 * edges_.size();  // about: a seam has more sides, a border fewer
    c.mesh.triangles.reserve(triangles);
    c.mesh.part.reserve(triangles);
    c.depth.reserve(triangles);
    for (std::size_t t = 0; t < whole.size(); ++t) {
      Pieces pieces{*this, {}};
      close_triangle(whole[t], pieces);
      for (const Triangle& piece : pieces.out) {
        c.mesh.triangles.push_back(assign(piece, whole[t]));
        c.mesh.part.push_back(part[t]);
        c.depth.push_back(depth[t]);
      }
    }
    std::erase_if(c.samples, [&](const EdgeSample& s) { return find(s.a, s.b) != nullptr; });
    return std::move(new_points_);
  }

 private:
  /// The operations of close_triangle. `near_a` stands for both vertices of an edge until a piece is assigned.
  struct Pieces {
    Cutter& self;
    std::vector<Triangle> out;
    bool split(std::uint32_t a, std::uint32_t b) const { return self.find(a, b) != nullptr; }
    std::uint32_t middle(std::uint32_t a, std::uint32_t b) const { return self.find(a, b)->near_a; }
    Vec3f position(std::uint32_t a) const { return self.closed_.mesh.position[a]; }
    void emit(const Triangle& t) { out.push_back(t); }
  };

  /// The place is that of the welded edge, the same bits for all its sides.
  void add_vertices(const Side& side, const Pierced& pierced) {
    const Mesh& mesh = closed_.mesh;
    const Triangle triangle = mesh.triangles[side.triangle];
    const float clear = std::min(kClear / length(mesh.position[side.b] - mesh.position[side.a]), 0.5F * pierced.from_a);
    const auto add = [&](std::uint32_t end, float light_at) {
      TransferPoint light = between(mesh, triangle, side.a, side.b, light_at);
      light.inward = (light.inward + mesh.position[end]) * 0.5F;
      const std::uint32_t vertex = append_between(closed_.mesh, side.a, side.b, pierced.middle());
      new_points_.push_back({vertex, light});
      return vertex;
    };
    const std::uint32_t near_a = add(side.a, pierced.from_a - clear), near_b = add(side.b, pierced.from_b + clear);
    edges_.push_back(side.a < side.b ? CutEdge{side.a, side.b, near_a, near_b}
                                     : CutEdge{side.b, side.a, near_b, near_a});
  }

  const CutEdge* find(std::uint32_t first, std::uint32_t second) const {
    const std::pair<std::uint32_t, std::uint32_t> key = std::minmax(first, second);
    const auto at = std::ranges::lower_bound(edges_, key, {}, [](const CutEdge& e) { return std::pair(e.a, e.b); });
    return at != edges_.end() && at->a == key.first && at->b == key.second ? &*at : nullptr;
  }

  /// Gives a piece of `whole` the vertices of its own side. One corner lies apart from the two others where two edges
  /// are cut. (Where all three are, the piece in the middle belongs to no corner and takes those of the lower
  /// vertices.)
  Triangle assign(Triangle piece, const Triangle& whole) const {
    const auto has = [&](std::uint32_t v) { return std::ranges::find(piece, v) != piece.end(); };
    std::array<int, 3> cuts{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (!find(whole[k], whole[(k + 1) % 3])) continue;
      ++cuts[k], ++cuts[(k + 1) % 3];
    }
    const bool two = cuts[0] + cuts[1] + cuts[2] == 4;
    Triangle out = piece;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      const CutEdge* edge = find(whole[k], whole[next]);
      if (!edge) continue;
      const auto alone = [&](std::uint32_t v) { return two && cuts[whole[k] == v ? k : next] == 2; };
      const bool at_a = has(edge->a) || (!has(edge->b) && !alone(edge->a));
      for (std::uint32_t& v : out) {
        if (v == edge->near_a && !at_a) v = edge->near_b;
      }
    }
    return out;
  }

  ClosedMesh& closed_;
  std::vector<CutEdge> edges_;
  std::vector<StandIn> new_points_;
};

}  // namespace

std::vector<StandIn> cut_pierced(ClosedMesh& closed, const PierceTest& test, const LightContrast& contrast,
                                 std::uint64_t budget, Threads& threads) {
  std::vector<Cut> cuts = find_cuts(closed.mesh, test, contrast, threads);
  keep_worthiest(cuts, budget - std::min<std::uint64_t>(budget, closed.mesh.triangles.size()));
  std::vector<StandIn> out;
  if (!cuts.empty()) out = Cutter(closed, cuts).run();

  const std::vector<StandIn> parted = part_vertices(closed.mesh, test, threads);
  const auto in = [](const std::vector<StandIn>& list, std::uint32_t v) {
    return std::ranges::binary_search(list, v, {}, &StandIn::vertex);
  };
  // Which of a vertex's shares an edge belongs to now is not known to its sample.
  std::erase_if(closed.samples, [&](const EdgeSample& e) { return in(parted, e.a) || in(parted, e.b); });
  std::erase_if(out, [&](const StandIn& s) { return in(parted, s.vertex); });
  out.insert(out.end(), parted.begin(), parted.end());
  std::ranges::sort(out, {}, &StandIn::vertex);
  return out;
}

}  // namespace kiln
