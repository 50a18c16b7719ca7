#pragma once
// A mesh of points, vertices and triangles whose edges can collapse: who is around whom, and what a collapse may not
// do.
//
// A crease is an edge with one triangle (border) or whose two triangles do not share both vertices or part (seam). A
// point without creases is free; others are in the middle of a border or of a seam, or junctions, where creases end,
// meet or cannot be told apart. A point on a border moves along it only, one on the outline of a part along that.
// Others cross into a chart beside them as well: the vertex of that chart joins, those of the other charts go along as
// they are, and what light and texture lose by that has its price (collapse_cost.h). Flat shading makes a junction of
// every point. What find_surface_points locks stays.
//
// Repeat  same bits always

#include <array>
#include <cstdint>
#include <vector>

#include "core/lightfield/lit_mesh.h"
#include "core/lightfield/surface_points.h"

namespace kiln {

enum class PointKind : std::uint8_t { free, border, seam, junction, locked };

/// The triangles on an edge between points p and q, and which vertices of p and q they join: at most two of each.
struct EdgeSides {
  std::uint32_t triangles = 0;  // more than 2 where p and q have several edges; then the rest says nothing
  std::array<std::uint32_t, 2> triangle{}, from{}, to{};
  std::uint32_t pairs = 0;  // different ones among (from, to), which stand first
  bool crease = false, outline = false;
  bool goes(std::uint32_t v) const { return (pairs > 0 && from[0] == v) || (pairs > 1 && from[1] == v); }
  bool takes(std::uint32_t w) const { return (pairs > 0 && to[0] == w) || (pairs > 1 && to[1] == w); }
};

class CollapseMesh {
 public:
  /// Keeps a reference to `lit`, whose triangles change with every join.
  CollapseMesh(LitMesh& lit, const SurfacePoints& points);

  std::size_t points() const { return first_vertex_.size(); }
  std::size_t triangles_left() const { return left_; }
  std::uint32_t point(std::uint32_t vertex) const { return point_[vertex]; }
  PointKind kind(std::uint32_t p) const { return kind_[p]; }
  bool gone(std::uint32_t triangle) const { return gone_[triangle]; }
  const Mesh& mesh() const { return lit_.mesh; }
  const LitMesh& lit() const { return lit_; }
  Vec3d position(std::uint32_t p) const { return to_double(lit_.mesh.position[first_vertex_[p]]); }

  /// Calls visit(triangle, next vertex, the one after) for each triangle around a vertex.
  template <class Visit>
  void around(std::uint32_t v, const Visit& visit) const {
    for (std::uint32_t corner = head_[v]; corner != kNone; corner = next_[corner]) {
      const Triangle& t = lit_.mesh.triangles[corner / 3];
      const std::uint32_t c = corner % 3;
      visit(corner / 3, t[c == 2 ? 0 : c + 1], t[c == 0 ? 2 : c - 1]);
    }
  }
  template <class Visit>
  void each_vertex(std::uint32_t p, const Visit& visit) const {
    for (std::uint32_t v = first_vertex_[p]; v != kNone; v = next_vertex_[v]) visit(v);
  }
  /// More triangles than kCrowd around a point: what is paid for each pair of its neighbours would never end. Such hubs
  /// stay, take nobody in, and cost nothing until there are fewer.
  bool crowded(std::uint32_t p) const;
  /// Calls visit(triangle, vertex of p, next vertex, the one after).
  template <class Visit>
  void around_point(std::uint32_t p, const Visit& visit) const {
    each_vertex(p, [&](std::uint32_t v) {
      around(v, [&](std::uint32_t t, std::uint32_t a, std::uint32_t b) { visit(t, v, a, b); });
    });
  }

  /// The points next to p, each once, in the order of its triangles. Valid until the next call.
  const std::vector<std::uint32_t>& ring(std::uint32_t p);
  EdgeSides sides(std::uint32_t p, std::uint32_t q) const;

  /// Whether `gone` may collapse into `kept`, and may then lie elsewhere than at `kept`.
  struct Allowed {
    bool at_kept = false, elsewhere = false;
  };
  Allowed allowed(std::uint32_t gone, std::uint32_t kept, const EdgeSides& sides) const;

  /// Link condition: the surface stays a manifold of the same shape, no piece of it vanishes, and of three creases
  /// around a triangle no two become one where a border or seam goes on.
  bool keeps_topology(std::uint32_t p, std::uint32_t q, const EdgeSides& sides);
  /// Whether a triangle around p without q would turn over, lose its area, become a needle or turn away from its
  /// vertices' normals, with p at `place`.
  bool spoils(std::uint32_t p, std::uint32_t q, const Vec3d& place) const;

  /// Vertices from[i] of `gone` become to[i] of `kept`, the others become vertices of `kept`; the triangles between
  /// vanish. The result is valid until the next call.
  struct Joined {
    std::vector<std::uint32_t> turned;   // 2 t + i for each triangle t whose corner went from from[i] to to[i]
    std::vector<std::uint32_t> orphans;  // vertices that have lost their last triangle and are no more
  };
  const Joined& join(std::uint32_t gone, std::uint32_t kept, const EdgeSides& sides);

 private:
  static constexpr std::uint32_t kNone = SurfacePoints::kNone;
  static constexpr int kCrowd = 100;
  void append(std::uint32_t v, std::uint32_t corner);
  void drop_gone(std::uint32_t v);
  void carry_rest(std::uint32_t gone, std::uint32_t kept, const EdgeSides& sides);
  void drop_orphan(std::uint32_t v);
  PointKind find_kind(std::uint32_t p, bool locked);
  std::uint32_t part_of(std::uint32_t t) const { return lit_.mesh.part.empty() ? 0 : lit_.mesh.part[t]; }
  bool next_to(std::uint32_t p, std::uint32_t q) const;

  LitMesh& lit_;
  std::vector<std::uint32_t> point_, first_vertex_, next_vertex_;  // vertices of a point
  std::vector<std::uint32_t> head_, tail_, next_;                  // corners of a vertex
  std::vector<PointKind> kind_;
  std::vector<bool> gone_;
  std::vector<bool> on_border_, on_outline_;  // points; a part's outline: borders, and where another begins
  std::size_t left_ = 0;
  std::vector<std::uint32_t> mark_, ring_, common_;
  Joined joined_;
  std::uint32_t stamp_ = 0;
};

}  // namespace kiln
