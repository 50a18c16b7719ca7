#pragma once
// A mesh under 1:4 splits that never cracks: the geometric half of adaptive subdivision.
//
// An edge is a pair of points in space (vertices welded by position), so both sides of a normal or uv seam, and all
// faces of a non-manifold edge, see the same split. A leaf whose edges were split by neighbours is closed as
// figure 3(b) of [Krivanek04], recursively; the number of triangles after that closure is exact at every moment.
//
//   leaf with k hanging vertices  ->  k + 1 triangles (more only where another face's edge runs inside the leaf)

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/welder.h"
#include "core/prt/transfer_point.h"

namespace kiln {

struct SplitLeaf {
  Triangle corner{};  // vertices
  std::uint32_t part = 0;
  std::uint32_t closed = 0;  // triangles after closure
  std::uint8_t depth = 0;    // 1:4 splits so far
  bool alive = true;         // false once split
};

/// The closed mesh: input vertices keep their indices, unused midpoints are gone.
struct ClosedMesh {
  Mesh mesh;
  std::vector<std::uint8_t> depth;    // of each triangle
  std::vector<std::uint32_t> vertex;  // of each final vertex: its index in SplitMesh::mesh()
};

class SplitMesh {
 public:
  explicit SplitMesh(const Mesh& input);

  /// Splits a living leaf into four. False, and nothing changed, when the closed mesh would have more than `budget`
  /// triangles or an edge is too short to have a point between its ends.
  bool split(std::uint32_t leaf, std::uint64_t budget);

  /// The vertex halfway along an edge of `leaf`, made when first asked for.
  std::uint32_t midpoint(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b);

  /// Removes the T-vertices. The first `kept_vertices` stay whether used or not. May make midpoints on seams: ask
  /// take_new_points once more.
  ClosedMesh close(std::size_t kept_vertices);

  /// Points of the vertices made since the last call, in vertex order.
  std::vector<TransferPoint> take_new_points() { return std::exchange(new_points_, {}); }

  const std::vector<SplitLeaf>& leaves() const { return leaves_; }  // the four of a split come last
  const Mesh& mesh() const { return mesh_; }                        // vertices only; triangles are the leaves
  std::uint64_t closed_triangles() const { return closed_triangles_; }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  struct Edge {                   // between two welded points
    std::uint32_t users = kNone;  // head of a list of leaves whose closure has this edge
    bool split = false;
  };
  struct User {
    std::uint32_t leaf, next;
  };
  struct Counter;
  struct Emitter;

  std::uint32_t point_at(const Vec3f& position);            // welded point; made when new
  std::uint32_t edge_at(std::uint32_t p, std::uint32_t q);  // between welded points; made when new
  bool is_split(std::uint32_t a, std::uint32_t b) const;    // between vertices
  void add_user(std::uint32_t edge, std::uint32_t leaf);
  void add_leaf(const Triangle& corner, std::uint32_t part, std::uint8_t depth);
  std::uint32_t count_closed(std::uint32_t leaf);
  std::optional<std::vector<std::uint32_t>> mark_split(const SplitLeaf& leaf);
  std::vector<std::uint32_t> leaves_on(const std::vector<std::uint32_t>& edges, std::uint32_t except) const;
  void make_children(std::uint32_t leaf);
  void keep_vertices(const std::vector<bool>& used, ClosedMesh& out) const;

  Mesh mesh_;
  std::vector<SplitLeaf> leaves_;
  std::vector<Vec3f> point_;         // of each welded id
  std::vector<std::uint32_t> weld_;  // of each vertex: welded id
  Welder welder_;
  std::vector<Edge> edges_;
  std::vector<User> users_;
  std::unordered_map<std::uint64_t, std::uint32_t> edge_index_;     // by welded ids
  std::unordered_map<std::uint64_t, std::uint32_t> middle_vertex_;  // by vertices
  std::vector<TransferPoint> new_points_;
  std::uint64_t closed_triangles_ = 0;
};

}  // namespace kiln
