#pragma once
// A mesh under 1:4 splits that never cracks: the geometric half of adaptive subdivision.
//
// An edge is a pair of points in space (vertices welded by position), so both sides of a normal or uv seam, and all
// faces of a non-manifold edge, see the same split. A leaf whose edges were split by neighbours is closed as
// figure 3(b) of [Krivanek04], recursively; the number of triangles after that closure is exact at every moment.
//
//   leaf with k hanging vertices  ->  k + 1 triangles (more only where another face's edge runs inside the leaf)
//
// Points where values are wanted are numbered as they come: the input's vertices, then the middles of edges that
// somebody asked for. A middle costs 16 bytes until its edge splits; only then it becomes a vertex with attributes.

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/index_table.h"
#include "core/mesh/mesh.h"
#include "core/mesh/welder.h"
#include "core/prt/transfer_point.h"

namespace kiln {

struct SplitLeaf {
  Triangle corner{};  // vertices
  std::uint32_t part = 0;
  std::uint32_t closed : 26 = 0;  // triangles after closure: far below 3 * 2^kMaxSplitDepth
  std::uint32_t depth : 5 = 0;    // 1:4 splits so far
  std::uint32_t alive : 1 = 1;    // 0 once split
};

/// The middle of an edge that did not split: where a value is known beside those at the vertices.
struct EdgeSample {
  std::uint32_t a, b;   // final vertices
  std::uint32_t point;  // whose value
  float area;           // of the final triangles on the edge
};

/// The closed mesh: input vertices keep their indices, unused midpoints are gone.
struct ClosedMesh {
  Mesh mesh;
  std::vector<std::uint8_t> depth;   // of each triangle
  std::vector<std::uint32_t> point;  // of each vertex
  std::vector<EdgeSample> samples;
};

class SplitMesh {
 public:
  explicit SplitMesh(const Mesh& input);

  /// Splits a living leaf into four. False, and nothing changed, when the closed mesh would have more than `budget`
  /// triangles or an edge is too short to have a point between its ends.
  bool split(std::uint32_t leaf, std::uint64_t budget);

  /// The point halfway along an edge of `leaf`, made when first asked for.
  std::uint32_t middle_point(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b);

  /// Removes the T-vertices and uses up the mesh. The first `kept_vertices` stay whether used or not. May make points
  /// on seams: ask take_new_points once more.
  ClosedMesh close(std::size_t kept_vertices);

  /// The points made since the last call, in their order.
  std::vector<TransferPoint> take_new_points() { return std::exchange(new_points_, {}); }

  const std::deque<SplitLeaf>& leaves() const { return leaves_; }  // the four of a split come last
  const Mesh& mesh() const { return mesh_; }                       // vertices only
  std::uint32_t point_of(std::uint32_t vertex) const { return point_[vertex]; }
  std::uint64_t closed_triangles() const { return closed_triangles_; }

 private:
  static constexpr std::uint32_t kNone = IndexTable::kNone;
  struct Edge {                     // between two welded places
    std::uint32_t p, q;             // p <= q
    std::uint32_t users = kNone;    // head of a list of leaves whose closure has this edge
    std::uint32_t middles = kNone;  // head of a list: one for each side of a seam
  };
  struct User {
    std::uint32_t leaf, next;
  };
  struct Middle {
    std::uint32_t a, b;  // vertices, a < b
    std::uint32_t vertex = kNone;
    std::uint32_t next;
  };
  struct Counter;
  struct Emitter;

  std::uint32_t place_at(const Vec3f& position);                    // welded; made when new
  std::uint32_t find_edge(std::uint32_t p, std::uint32_t q) const;  // between welded places, or kNone
  std::uint32_t edge_at(std::uint32_t p, std::uint32_t q);          // made when new
  bool is_split(std::uint32_t a, std::uint32_t b) const;            // between vertices
  std::uint32_t find_middle(std::uint32_t a, std::uint32_t b) const;
  std::uint32_t middle_at(const SplitLeaf&, std::uint32_t a, std::uint32_t b);
  std::uint32_t middle_vertex(const SplitLeaf&, std::uint32_t a, std::uint32_t b);
  void add_new_point(const SplitLeaf&, std::uint32_t a, std::uint32_t b);
  void add_user(std::uint32_t edge, std::uint32_t leaf);
  void forget_users(std::uint32_t edge);
  void add_leaf(const Triangle& corner, std::uint32_t part, std::uint8_t depth);
  std::uint32_t count_closed(std::uint32_t leaf);
  std::optional<std::vector<std::uint32_t>> mark_split(const SplitLeaf& leaf);
  std::vector<std::uint32_t> leaves_on(const std::vector<std::uint32_t>& edges, std::uint32_t except) const;
  void make_children(std::uint32_t leaf);
  std::vector<float> areas_of_samples(const ClosedMesh&) const;
  std::vector<std::uint32_t> keep_vertices(const std::vector<bool>& used, ClosedMesh& out) const;

  Mesh mesh_;
  std::uint32_t input_vertices_;
  std::deque<SplitLeaf> leaves_;
  std::vector<std::uint32_t> weld_;   // of each vertex: welded id
  std::vector<std::uint32_t> point_;  // of each vertex
  Welder welder_;                     // its n-th position is that of welded id n
  std::deque<Edge> edges_;
  std::vector<bool> split_;  // of each edge
  IndexTable edge_table_;
  std::deque<User> users_;
  std::uint32_t free_users_ = kNone;  // a list of those whose edge has split
  std::deque<Middle> middles_;        // point input_vertices_ + i
  std::vector<TransferPoint> new_points_;
  std::uint64_t closed_triangles_ = 0;
};

}  // namespace kiln
