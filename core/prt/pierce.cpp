#include "core/prt/pierce.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <tuple>
#include <utility>

#include "core/mesh/midpoint.h"
#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"
#include "core/prt/split_closure.h"

namespace kiln {
namespace {

constexpr float kEnds = 1.0F / 64;  // of an edge: nearer to its ends it is not cut
constexpr float kClear = 3e-5F;     // unit cube: from there rays neither meet the surface nor what pierces it

constexpr float kThick =
    1.0F / 8;                     // of an edge: what is longer between two surfaces has light of its own and is no cut
constexpr float kStands = 1e-4F;  // unit cube: what ends below that height pierces nothing. Tiles that overlap in one
                                  // plane are within rounding of each other.

/// A point at `share` of the way from a to b that leans into `triangle`.
TransferPoint between(const Mesh& mesh, const Triangle& triangle, std::uint32_t a, std::uint32_t b, float share) {
  const Vec3f normal = normalized(mesh.normal[a] * (1 - share) + mesh.normal[b] * share, mesh.normal[a]);
  const auto& [p, q, r] = triangle;
  return {.position = mesh.position[a] + (mesh.position[b] - mesh.position[a]) * share,
          .normal = normal,
          .inward = (mesh.position[p] + mesh.position[q] + mesh.position[r]) / 3.0F,
          .face_normal = normalized(area_vector(mesh, triangle), normal)};
}

std::optional<Pierced> find_pierced(const Tracer& tracer, const TransferPoint& a, const TransferPoint& b) {
  const Vec3f start = ray_origin(a), end = ray_origin(b);
  const float way = length(end - start);
  if (!(way > 0)) return std::nullopt;
  const Vec3f along = (end - start) / way;
  const Hit there = tracer.closest(start, along, way);
  if (!there) return std::nullopt;
  const Hit back = tracer.closest(end, -along, way);
  if (!back || !tracer.occluded(start + a.normal * kStands, along, way)) return std::nullopt;
  return Pierced{std::clamp(there.t / way, 0.0F, 1.0F), 1 - std::clamp(back.t / way, 0.0F, 1.0F)};
}

/// Where an edge of a triangle is pierced between its ends.
std::optional<Pierced> pierced_edge(const Mesh& mesh, const Triangle& t, std::uint32_t a, std::uint32_t b,
                                    const PierceTest& test) {
  const float edge = length(mesh.position[b] - mesh.position[a]);
  const float margin = std::max(kEnds, edge > 0 ? kClear / edge : 1.0F);
  if (margin > 0.25F) return std::nullopt;
  const auto found = test(between(mesh, t, a, b, margin), between(mesh, t, a, b, 1 - margin));
  if (!found) return std::nullopt;
  const auto whole = [&](float share) { return margin + (1 - 2 * margin) * share; };
  return Pierced{whole(found->from_a), whole(found->from_b)};
}

bool can_be_cut(const Pierced& p) { return p.from_b - p.from_a < kThick; }
float middle_of(const Pierced& p) { return 0.5F * (p.from_a + p.from_b); }

/// Whether the line through two edges of a triangle, met at these shares of them from their common corner, is met
/// halfway between as well.
bool is_straight(const Mesh& mesh, const Triangle& t, std::size_t corner, float on_next, float on_before,
                 const PierceTest& test) {
  constexpr float kOff = 1.0F / 16;
  const Vec3f at = mesh.position[t[corner]];
  const Vec3f middle = (mesh.position[t[(corner + 1) % 3]] - at) * (0.5F * on_next) +
                       (mesh.position[t[(corner + 2) % 3]] - at) * (0.5F * on_before);
  const float share = 0.5F * (on_next + on_before);  // of the way through the middle to the third edge
  TransferPoint near = between(mesh, t, t[corner], t[corner], 0), far = near;
  near.position = at + middle * (kEnds / share);
  far.position = at + middle * ((1 - kEnds) / share);
  const auto found = test(near, far);
  return found && std::abs(kEnds + (1 - 2 * kEnds) * middle_of(*found) - share) < kOff;
}

/// One edge in space: between welded places p < q, as it lies on one side of a seam.
struct Side {
  std::uint32_t p, q;  // places
  std::uint32_t a, b;  // vertices there
  std::uint32_t triangle;
};

std::vector<Side> sides_of(const Mesh& mesh) {
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      if (place[a] > place[b]) std::swap(a, b);
      if (place[a] != place[b]) sides.push_back({place[a], place[b], a, b, t});
    }
  }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.p, s.q, s.a, s.b, s.triangle); });
  return sides;
}

/// All sides of one pierced edge.
struct Cut {
  std::size_t first, last;  // of the sides
  Pierced pierced;
  float worth;  // change of light times length
};

std::vector<Cut> find_cuts(const Mesh& mesh, const std::vector<Side>& sides, const PierceTest& test,
                           const LightContrast& contrast, Threads& threads) {
  std::vector<Cut> edges;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i > 0 && sides[i].p == sides[i - 1].p && sides[i].q == sides[i - 1].q) {
      edges.back().last = i + 1;
    } else {
      edges.push_back({i, i + 1, {}, 0});
    }
  }
  std::vector<char> found(edges.size(), 0);
  threads.for_blocks(edges.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Side& s = sides[edges[i].first];
      const auto pierced = pierced_edge(mesh, mesh.triangles[s.triangle], s.a, s.b, test);
      if (!pierced || !can_be_cut(*pierced)) continue;
      edges[i].pierced = *pierced;
      edges[i].worth = contrast(s.a, s.b) * length(mesh.position[s.b] - mesh.position[s.a]);
      found[i] = 1;
    }
  });
  std::vector<Cut> out;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (found[i]) out.push_back(edges[i]);
  }
  return out;
}

/// Each side of a cut edge is one more triangle: the worthiest are kept, as many as fit.
void keep_worthiest(std::vector<Cut>& cuts, std::uint64_t room) {
  std::ranges::stable_sort(cuts, std::greater{}, &Cut::worth);
  std::uint64_t used = 0;
  std::erase_if(cuts, [&](const Cut& c) {
    const std::uint64_t more = c.last - c.first;
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
  Cutter(ClosedMesh& closed, const std::vector<Side>& sides, const std::vector<Cut>& cuts) : closed_(closed) {
    for (const Cut& cut : cuts) {
      for (std::size_t i = cut.first; i < cut.last; ++i) {
        const bool known = i > cut.first && sides[i].a == sides[i - 1].a && sides[i].b == sides[i - 1].b;
        if (!known) add_vertices(sides[i], cut.pierced);
      }
    }
    std::ranges::sort(edges_, {}, [](const CutEdge& e) { return std::pair(e.a, e.b); });
  }

  std::vector<StandIn> run() {
    ClosedMesh& c = closed_;
    const std::vector<Triangle> whole = std::exchange(c.mesh.triangles, {});
    const std::vector<std::uint32_t> part = std::exchange(c.mesh.part, {});
    const std::vector<std::uint8_t> depth = std::exchange(c.depth, {});
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
    const float clear = std::min(kClear / length(mesh.position[side.b] - mesh.position[side.a]), 0.5F * kEnds);
    const auto add = [&](std::uint32_t end, float light_at) {
      TransferPoint light = between(mesh, triangle, side.a, side.b, light_at);
      light.inward = (light.inward + mesh.position[end]) * 0.5F;
      const std::uint32_t vertex = append_between(closed_.mesh, side.a, side.b, middle_of(pierced));
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

// A contact line may run along edges: then the two triangles of such an edge see different light at its ends, and a
// vertex whose triangles fall apart at such edges becomes one vertex for each share of them.

constexpr float kFlat = 0.9999F;  // cosine between faces: over a crease the way between them leads through the surface
constexpr float kAcross =
    1.0F / 16;  // of the way from an edge to the middle of its triangle: nearer lines count as on it

Vec3f centroid(const Mesh& mesh, const Triangle& t) {
  return (mesh.position[t[0]] + mesh.position[t[1]] + mesh.position[t[2]]) / 3.0F;
}

/// How far into each of two triangles one must go from their common edge to be past what stands between them: shares of
/// the way to their middles. Nothing where nothing does.
std::optional<std::array<float, 2>> between_triangles(const Mesh& mesh, const std::array<Triangle, 2>& side,
                                                      std::uint32_t a, std::uint32_t b, const PierceTest& test) {
  const Vec3f edge = (mesh.position[a] + mesh.position[b]) * 0.5F, normal = middle_normal(mesh, a, b);
  std::array<TransferPoint, 2> point;
  std::array<float, 2> share{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3f inward = centroid(mesh, side[k]), face = normalized(area_vector(mesh, side[k]), normal);
    const float way = length(inward - edge);
    if (!(way > 4 * kClear)) return std::nullopt;
    share[k] = std::max(kAcross, kClear / way);
    point[k] = {edge + (inward - edge) * share[k], normal, inward, face};
  }
  if (dot(point[0].face_normal, point[1].face_normal) < kFlat) return std::nullopt;
  const auto found = test(point[0], point[1]);
  if (!found) return std::nullopt;
  const float whole = share[0] + share[1];
  return std::array{std::max(0.0F, share[0] - found->from_a * whole), std::max(0.0F, found->from_b * whole - share[0])};
}

class Separator {
 public:
  Separator(ClosedMesh& closed, const std::vector<Side>& sides, const PierceTest& test, Threads& threads)
      : mesh_(closed.mesh), parent_(3 * mesh_.triangles.size()), past_(mesh_.triangles.size(), 0.0F) {
    for (std::uint32_t c = 0; c < parent_.size(); ++c) parent_[c] = c;
    split_.assign(mesh_.position.size(), false);
    join_sides(sides, test, threads);
  }

  std::vector<StandIn> run() {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> corners;  // vertex, corner
    for (std::uint32_t c = 0; c < parent_.size(); ++c) {
      const std::uint32_t v = mesh_.triangles[c / 3][c % 3];
      if (split_[v]) corners.emplace_back(v, c);
    }
    std::ranges::sort(corners);
    std::vector<StandIn> out;
    for (std::size_t i = 0, end = 0; i < corners.size(); i = end) {
      while (end < corners.size() && corners[end].first == corners[i].first) ++end;
      separate(std::span(corners).subspan(i, end - i), out);
    }
    std::ranges::sort(out, {}, &StandIn::vertex);
    return out;
  }

 private:
  using Corners = std::span<const std::pair<std::uint32_t, std::uint32_t>>;

  std::uint32_t root(std::uint32_t c) {
    while (parent_[c] != c) c = parent_[c] = parent_[parent_[c]];
    return c;
  }
  void join(std::uint32_t c, std::uint32_t d) {
    const auto [low, high] = std::minmax({root(c), root(d)});
    parent_[high] = low;
  }
  std::uint32_t corner_of(std::uint32_t triangle, std::uint32_t vertex) const {
    const Triangle& t = mesh_.triangles[triangle];
    return 3 * triangle + (t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2);
  }

  /// Corners stay together over edges that nothing stands on.
  void join_sides(const std::vector<Side>& sides, const PierceTest& test, Threads& threads) {
    std::vector<std::optional<std::array<float, 2>>> apart(sides.size());
    const auto same = [&](std::size_t i) {
      return i + 1 < sides.size() && sides[i].a == sides[i + 1].a && sides[i].b == sides[i + 1].b;
    };
    threads.for_blocks(sides.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (!same(i)) continue;
        apart[i] =
            between_triangles(mesh_, {mesh_.triangles[sides[i].triangle], mesh_.triangles[sides[i + 1].triangle]},
                              sides[i].a, sides[i].b, test);
      }
    });
    for (std::size_t i = 0; i < sides.size(); ++i) {
      if (!same(i)) continue;
      const std::array<std::uint32_t, 2> t{sides[i].triangle, sides[i + 1].triangle};
      for (const std::uint32_t v : {sides[i].a, sides[i].b}) {
        if (apart[i])
          split_[v] = true;
        else
          join(corner_of(t[0], v), corner_of(t[1], v));
      }
      if (!apart[i]) continue;
      for (std::size_t k = 0; k < 2; ++k) past_[t[k]] = std::max(past_[t[k]], (*apart[i])[k]);
    }
  }

  /// The first share of the corners keeps the vertex, the others get copies.
  void separate(Corners corners, std::vector<StandIn>& out) {
    const std::uint32_t vertex = corners[0].first;
    std::vector<std::uint32_t> roots;
    for (const auto& [v, c] : corners) {
      if (std::ranges::find(roots, root(c)) == roots.end()) roots.push_back(root(c));
    }
    if (roots.size() < 2) return;
    for (const std::uint32_t r : roots) {
      const std::uint32_t mine = r == roots[0] ? vertex : append_between(mesh_, vertex, vertex, 0);
      std::uint32_t widest = kNoFace;
      for (const auto& [v, c] : corners) {
        if (root(c) != r) continue;
        if (widest == kNoFace ||
            triangle_area(mesh_, mesh_.triangles[c / 3]) > triangle_area(mesh_, mesh_.triangles[widest]))
          widest = c / 3;
      }
      out.push_back({mine, light_in(vertex, widest)});
      for (const auto& [v, c] : corners) {
        if (root(c) == r) renamed_.emplace_back(c, mine);
      }
    }
    for (const auto& [c, mine] : renamed_) mesh_.triangles[c / 3][c % 3] = mine;
    renamed_.clear();
  }

  /// The light of a vertex on the side of one of its triangles, past what stands at the vertex.
  TransferPoint light_in(std::uint32_t vertex, std::uint32_t triangle) const {
    const Vec3f inward = centroid(mesh_, mesh_.triangles[triangle]), at = mesh_.position[vertex];
    const float way = length(inward - at), share = std::min(0.5F, past_[triangle] + kClear / std::max(way, kClear));
    return {.position = at + (inward - at) * share,
            .normal = mesh_.normal[vertex],
            .inward = inward,
            .face_normal = normalized(area_vector(mesh_, mesh_.triangles[triangle]), mesh_.normal[vertex])};
  }

  Mesh& mesh_;
  std::vector<std::uint32_t> parent_;  // of each corner of each triangle
  std::vector<float> past_;            // of each triangle: how far to go in to be past what stands at its edges
  std::vector<bool> split_;            // of each vertex: something stands on an edge of it
  std::vector<std::pair<std::uint32_t, std::uint32_t>> renamed_;
};

}  // namespace

PierceTest pierce_test(const Tracer& tracer) {
  return [&tracer](const TransferPoint& a, const TransferPoint& b) { return find_pierced(tracer, a, b); };
}

PiercedTriangle pierced_triangle(const Mesh& mesh, const Triangle& t, const PierceTest& test) {
  std::array<std::optional<Pierced>, 3> edge;  // edge k from corner k to the next
  PiercedTriangle out;
  for (std::size_t k = 0; k < 3; ++k) {
    edge[k] = pierced_edge(mesh, t, t[k], t[(k + 1) % 3], test);
    if (edge[k] && can_be_cut(*edge[k])) ++out.edges;
  }
  const auto pierced = std::ranges::count_if(edge, [](const auto& e) { return e.has_value(); });
  if (out.edges == 2 && pierced == 2) {
    const std::size_t apart = !edge[0] ? 2 : !edge[1] ? 0 : 1;  // the corner of both edges
    const std::size_t next = apart, before = (apart + 2) % 3;   // edges that leave it and arrive
    out.straight = is_straight(mesh, t, apart, middle_of(*edge[next]), 1 - middle_of(*edge[before]), test);
  }
  return out;
}

std::vector<StandIn> cut_pierced(ClosedMesh& closed, const PierceTest& test, const LightContrast& contrast,
                                 std::uint64_t budget, Threads& threads) {
  std::vector<StandIn> out;
  {
    const std::vector<Side> sides = sides_of(closed.mesh);
    std::vector<Cut> cuts = find_cuts(closed.mesh, sides, test, contrast, threads);
    keep_worthiest(cuts, budget - std::min<std::uint64_t>(budget, closed.mesh.triangles.size()));
    if (!cuts.empty()) out = Cutter(closed, sides, cuts).run();
  }
  const std::vector<StandIn> apart = Separator(closed, sides_of(closed.mesh), test, threads).run();
  const auto in = [](const std::vector<StandIn>& list, std::uint32_t v) {
    return std::ranges::binary_search(list, v, {}, &StandIn::vertex);
  };
  // Which of a vertex's shares an edge belongs to now is not known to its sample.
  std::erase_if(closed.samples, [&](const EdgeSample& e) { return in(apart, e.a) || in(apart, e.b); });
  std::erase_if(out, [&](const StandIn& s) { return in(apart, s.vertex); });
  out.insert(out.end(), apart.begin(), apart.end());
  std::ranges::sort(out, {}, &StandIn::vertex);
  return out;
}

}  // namespace kiln
