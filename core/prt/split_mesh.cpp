#include "core/prt/split_mesh.h"

#include <algorithm>

#include "core/mesh/midpoint.h"
#include "core/mesh/topology.h"
#include "core/prt/split_closure.h"

namespace kiln {
namespace {

std::uint64_t pair_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

}  // namespace

SplitMesh::SplitMesh(const Mesh& input) : mesh_(input) {
  mesh_.triangles = {};
  mesh_.part = {};
  weld_.reserve(input.position.size());
  welder_.reserve(input.position.size());
  edge_index_.reserve(input.triangles.size() * 2);
  for (const Vec3f& p : input.position) weld_.push_back(point_at(p));
  leaves_.reserve(input.triangles.size());
  for (std::size_t t = 0; t < input.triangles.size(); ++t) add_leaf(input.triangles[t], input.part[t], 0);
}

std::uint32_t SplitMesh::point_at(const Vec3f& position) {
  const auto fresh = static_cast<std::uint32_t>(point_.size());
  const std::uint32_t id = welder_.weld(position, fresh);
  if (id == fresh) point_.push_back(position);
  return id;
}

std::uint32_t SplitMesh::edge_at(std::uint32_t p, std::uint32_t q) {
  const auto [found, fresh] = edge_index_.try_emplace(pair_key(p, q), static_cast<std::uint32_t>(edges_.size()));
  if (fresh) edges_.emplace_back();
  return found->second;
}

bool SplitMesh::is_split(std::uint32_t a, std::uint32_t b) const {
  const auto found = edge_index_.find(pair_key(weld_[a], weld_[b]));
  return found != edge_index_.end() && edges_[found->second].split;
}

std::uint32_t SplitMesh::midpoint(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b) {
  const auto [found, fresh] = middle_vertex_.try_emplace(pair_key(a, b), 0);
  if (!fresh) return found->second;
  found->second = append_midpoint(mesh_, a, b);
  weld_.push_back(point_at(mesh_.position.back()));
  const auto& [p, q, r] = leaf.corner;
  new_points_.push_back({.position = mesh_.position.back(),
                         .normal = mesh_.normal.back(),
                         .inward = (mesh_.position[p] + mesh_.position[q] + mesh_.position[r]) / 3.0F,
                         .face_normal = normalized(area_vector(mesh_, leaf.corner), mesh_.normal.back())});
  return found->second;
}

void SplitMesh::add_user(std::uint32_t edge, std::uint32_t leaf) {
  for (std::uint32_t u = edges_[edge].users; u != kNone; u = users_[u].next) {
    if (users_[u].leaf == leaf) return;
  }
  users_.push_back({leaf, edges_[edge].users});
  edges_[edge].users = static_cast<std::uint32_t>(users_.size() - 1);
}

// Triangles after closure, on welded points; the leaf is told of every edge its closure rests on.
struct SplitMesh::Counter {
  SplitMesh& self;
  std::uint32_t leaf;
  std::uint32_t triangles = 0;

  bool split(std::uint32_t p, std::uint32_t q) {
    if (p == q) return false;
    const std::uint32_t edge = self.edge_at(p, q);
    if (!self.edges_[edge].split) self.add_user(edge, leaf);
    return self.edges_[edge].split;
  }
  std::uint32_t middle(std::uint32_t p, std::uint32_t q) {
    return self.point_at(kiln::middle(position(p), position(q)));
  }
  Vec3f position(std::uint32_t p) const { return self.point_[p]; }
  void emit(const Triangle&) { ++triangles; }
};

std::uint32_t SplitMesh::count_closed(std::uint32_t leaf) {
  const Triangle& c = leaves_[leaf].corner;
  Counter counter{*this, leaf};
  close_triangle(Triangle{weld_[c[0]], weld_[c[1]], weld_[c[2]]}, counter);
  return counter.triangles;
}

void SplitMesh::add_leaf(const Triangle& corner, std::uint32_t part, std::uint8_t depth) {
  leaves_.push_back({.corner = corner, .part = part, .depth = depth});
  leaves_.back().closed = count_closed(static_cast<std::uint32_t>(leaves_.size() - 1));
  closed_triangles_ += leaves_.back().closed;
}

// Marks the unsplit edges of a leaf as split and returns them; nothing where an edge has no point between its ends.
std::optional<std::vector<std::uint32_t>> SplitMesh::mark_split(const SplitLeaf& leaf) {
  std::vector<std::uint32_t> marked;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t p = weld_[leaf.corner[k]], q = weld_[leaf.corner[(k + 1) % 3]];
    const Vec3f between = middle(point_[p], point_[q]);
    if (p == q || between == point_[p] || between == point_[q]) return std::nullopt;
    const std::uint32_t edge = edge_at(p, q);
    if (!edges_[edge].split) marked.push_back(edge);
  }
  for (const std::uint32_t edge : marked) edges_[edge].split = true;
  return marked;
}

std::vector<std::uint32_t> SplitMesh::leaves_on(const std::vector<std::uint32_t>& edges, std::uint32_t except) const {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t edge : edges) {
    for (std::uint32_t u = edges_[edge].users; u != kNone; u = users_[u].next) {
      if (users_[u].leaf != except && leaves_[users_[u].leaf].alive) found.push_back(users_[u].leaf);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

bool SplitMesh::split(std::uint32_t index, std::uint64_t budget) {
  const std::optional<std::vector<std::uint32_t>> marked = mark_split(leaves_[index]);
  if (!marked) return false;

  // What the closed mesh would have: this leaf's own closure is its four children with theirs.
  std::vector<std::uint32_t> touched = leaves_on(*marked, index);
  touched.push_back(index);
  std::uint64_t total = closed_triangles_;
  std::vector<std::uint32_t> closed;
  for (const std::uint32_t leaf : touched) {
    closed.push_back(count_closed(leaf));
    total = total - leaves_[leaf].closed + closed.back();
  }
  if (total > budget) {
    for (const std::uint32_t edge : *marked) edges_[edge].split = false;
    return false;
  }

  for (std::size_t i = 0; i < touched.size(); ++i) leaves_[touched[i]].closed = closed[i];
  closed_triangles_ = total - closed.back();  // the children bring it back
  make_children(index);
  return true;
}

void SplitMesh::make_children(std::uint32_t index) {
  leaves_[index].alive = false;
  const SplitLeaf leaf = leaves_[index];
  const auto [a, b, c] = leaf.corner;
  const std::uint32_t ab = midpoint(leaf, a, b), bc = midpoint(leaf, b, c), ca = midpoint(leaf, c, a);
  for (const Triangle& child : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}}) {
    add_leaf(child, leaf.part, static_cast<std::uint8_t>(leaf.depth + 1));
  }
}

// The closure on vertices: each side of a seam gets its own midpoints.
struct SplitMesh::Emitter {
  SplitMesh& self;
  const SplitLeaf& leaf;
  ClosedMesh& out;

  bool split(std::uint32_t a, std::uint32_t b) const { return self.is_split(a, b); }
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) { return self.midpoint(leaf, a, b); }
  Vec3f position(std::uint32_t a) const { return self.mesh_.position[a]; }
  void emit(const Triangle& t) {
    out.mesh.triangles.push_back(t);
    out.mesh.part.push_back(leaf.part);
    out.depth.push_back(leaf.depth);
  }
};

ClosedMesh SplitMesh::close(std::size_t kept_vertices) {
  ClosedMesh out;
  for (const SplitLeaf& leaf : leaves_) {
    Emitter emitter{*this, leaf, out};
    if (leaf.alive) close_triangle(leaf.corner, emitter);
  }
  std::vector<bool> used(mesh_.position.size(), false);
  std::fill_n(used.begin(), kept_vertices, true);
  for (const Triangle& t : out.mesh.triangles) used[t[0]] = used[t[1]] = used[t[2]] = true;
  keep_vertices(used, out);
  return out;
}

void SplitMesh::keep_vertices(const std::vector<bool>& used, ClosedMesh& out) const {
  std::vector<std::uint32_t> renamed(used.size(), kNone);
  const auto keep = [](std::uint32_t v, const auto& from, auto& to) {
    if (!from.empty()) to.push_back(from[v]);
  };
  for (std::uint32_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    renamed[v] = static_cast<std::uint32_t>(out.vertex.size());
    out.vertex.push_back(v);
    keep(v, mesh_.position, out.mesh.position);
    keep(v, mesh_.normal, out.mesh.normal);
    keep(v, mesh_.uv0, out.mesh.uv0);
    keep(v, mesh_.uv1, out.mesh.uv1);
    keep(v, mesh_.color, out.mesh.color);
    keep(v, mesh_.tangent, out.mesh.tangent);
  }
  for (Triangle& t : out.mesh.triangles) t = {renamed[t[0]], renamed[t[1]], renamed[t[2]]};
}

}  // namespace kiln
