#include "core/prt/split_mesh.h"

#include <algorithm>

#include "core/base/random.h"
#include "core/mesh/midpoint.h"
#include "core/mesh/topology.h"
#include "core/prt/split_closure.h"

namespace kiln {
namespace {

constexpr std::uint32_t kMostClosed = (1U << 26) - 1;

/// Grows by an eighth at a time: memory counts here more than copies do.
template <class T>
void make_room(std::vector<T>& v) {
  if (v.size() == v.capacity()) v.reserve(v.size() + v.size() / 8 + 64);
}

void make_room(Mesh& mesh) {
  make_room(mesh.position);
  make_room(mesh.normal);
  if (!mesh.uv0.empty()) make_room(mesh.uv0);
  if (!mesh.uv1.empty()) make_room(mesh.uv1);
  if (!mesh.color.empty()) make_room(mesh.color);
  if (!mesh.tangent.empty()) make_room(mesh.tangent);
}

std::uint64_t hash_pair(std::uint32_t p, std::uint32_t q) { return mix64(std::uint64_t{p} << 32 | q); }

}  // namespace

SplitMesh::SplitMesh(const Mesh& input)
    : mesh_(input), input_vertices_(static_cast<std::uint32_t>(input.position.size())) {
  mesh_.triangles = {};
  mesh_.part = {};
  for (std::uint32_t v = 0; v < input_vertices_; ++v) {
    weld_.push_back(place_at(input.position[v]));
    point_.push_back(v);
  }
  for (std::size_t t = 0; t < input.triangles.size(); ++t) add_leaf(input.triangles[t], input.part[t], 0);
}

std::uint32_t SplitMesh::place_at(const Vec3f& position) {
  return welder_.weld(position, static_cast<std::uint32_t>(welder_.size()));
}

std::uint32_t SplitMesh::find_edge(std::uint32_t first, std::uint32_t second) const {
  const auto [p, q] = std::minmax(first, second);
  return edge_table_.find(hash_pair(p, q),
                          [&, p = p, q = q](std::uint32_t e) { return edges_[e].p == p && edges_[e].q == q; });
}

std::uint32_t SplitMesh::edge_at(std::uint32_t p, std::uint32_t q) {
  const std::uint32_t known = find_edge(p, q);
  if (known != kNone) return known;
  const auto fresh = static_cast<std::uint32_t>(edges_.size());
  edges_.push_back({std::min(p, q), std::max(p, q)});
  split_.push_back(false);
  edge_table_.add(fresh, [&](std::uint32_t e) { return hash_pair(edges_[e].p, edges_[e].q); });
  return fresh;
}

bool SplitMesh::is_split(std::uint32_t a, std::uint32_t b) const {
  const std::uint32_t edge = find_edge(weld_[a], weld_[b]);
  return edge != kNone && split_[edge];
}

std::uint32_t SplitMesh::find_middle(std::uint32_t first, std::uint32_t second) const {
  const auto [a, b] = std::minmax(first, second);
  const std::uint32_t edge = find_edge(weld_[a], weld_[b]);
  std::uint32_t m = edge == kNone ? kNone : edges_[edge].middles;
  while (m != kNone && (middles_[m].a != a || middles_[m].b != b)) m = middles_[m].next;
  return m;
}

std::uint32_t SplitMesh::middle_at(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b) {
  const std::uint32_t known = find_middle(a, b);
  if (known != kNone) return known;
  const auto fresh = static_cast<std::uint32_t>(middles_.size());
  Edge& edge = edges_[edge_at(weld_[a], weld_[b])];
  middles_.push_back({.a = std::min(a, b), .b = std::max(a, b), .next = std::exchange(edge.middles, fresh)});
  add_new_point(leaf, a, b);
  return fresh;
}

/// The same bits whichever way round the edge is asked for.
void SplitMesh::add_new_point(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b) {
  new_points_.push_back(edge_point(mesh_, leaf.corner, std::min(a, b), std::max(a, b), 0.5F));
  new_points_.back().position = middle(mesh_.position[a], mesh_.position[b]);
  new_points_.back().normal = middle_normal(mesh_, a, b);
}

std::uint32_t SplitMesh::middle_point(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b) {
  return input_vertices_ + middle_at(leaf, a, b);
}

std::uint32_t SplitMesh::middle_vertex(const SplitLeaf& leaf, std::uint32_t a, std::uint32_t b) {
  const std::uint32_t m = middle_at(leaf, a, b);
  if (middles_[m].vertex != kNone) return middles_[m].vertex;
  make_room(weld_);
  make_room(point_);
  make_room(mesh_);
  weld_.push_back(place_at(middle(mesh_.position[a], mesh_.position[b])));
  point_.push_back(input_vertices_ + m);
  return middles_[m].vertex = append_midpoint(mesh_, a, b);
}

void SplitMesh::add_user(std::uint32_t edge, std::uint32_t leaf) {
  for (std::uint32_t u = edges_[edge].users; u != kNone; u = users_[u].next) {
    if (users_[u].leaf == leaf) return;
  }
  std::uint32_t u = free_users_;
  if (u == kNone) {
    u = static_cast<std::uint32_t>(users_.size());
    users_.emplace_back();
  } else {
    free_users_ = users_[u].next;
  }
  users_[u] = {leaf, edges_[edge].users};
  edges_[edge].users = u;
}

// Nobody asks a split edge who rests on it.
void SplitMesh::forget_users(std::uint32_t edge) {
  std::uint32_t* end = &edges_[edge].users;
  while (*end != kNone) end = &users_[*end].next;
  *end = std::exchange(free_users_, edges_[edge].users);
  edges_[edge].users = kNone;
}

// Triangles after closure, on welded points; the leaf is told of every edge its closure rests on.
struct SplitMesh::Counter {
  SplitMesh& self;
  std::uint32_t leaf;
  std::uint32_t triangles = 0;

  bool split(std::uint32_t p, std::uint32_t q) {
    if (p == q) return false;
    const std::uint32_t edge = self.edge_at(p, q);
    if (!self.split_[edge]) self.add_user(edge, leaf);
    return self.split_[edge];
  }
  std::uint32_t middle(std::uint32_t p, std::uint32_t q) {
    return self.place_at(kiln::middle(position(p), position(q)));
  }
  Vec3f position(std::uint32_t p) const { return self.welder_.position(p); }
  void emit(const Triangle&) { ++triangles; }
};

std::uint32_t SplitMesh::count_closed(std::uint32_t leaf) {
  const Triangle& c = leaves_[leaf].corner;
  Counter counter{*this, leaf};
  close_triangle(Triangle{weld_[c[0]], weld_[c[1]], weld_[c[2]]}, counter);
  return counter.triangles;
}

void SplitMesh::add_leaf(const Triangle& corner, std::uint32_t part, std::uint8_t depth) {
  leaves_.push_back({.corner = corner, .part = part, .depth = depth & 31U});
  leaves_.back().closed = count_closed(static_cast<std::uint32_t>(leaves_.size() - 1)) & kMostClosed;
  closed_triangles_ += leaves_.back().closed;
}

// Marks the unsplit edges of a leaf as split and returns them; nothing where an edge has no point between its ends.
std::optional<std::vector<std::uint32_t>> SplitMesh::mark_split(const SplitLeaf& leaf) {
  std::vector<std::uint32_t> marked;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t p = weld_[leaf.corner[k]], q = weld_[leaf.corner[(k + 1) % 3]];
    const Vec3f at_p = welder_.position(p), at_q = welder_.position(q), between = middle(at_p, at_q);
    if (p == q || between == at_p || between == at_q) return std::nullopt;
    const std::uint32_t edge = edge_at(p, q);
    if (!split_[edge]) marked.push_back(edge);
  }
  for (const std::uint32_t edge : marked) split_[edge] = true;
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
    for (const std::uint32_t edge : *marked) split_[edge] = false;
    return false;
  }

  for (std::size_t i = 0; i < touched.size(); ++i) leaves_[touched[i]].closed = closed[i] & kMostClosed;
  closed_triangles_ = total - closed.back();  // the children bring it back
  for (const std::uint32_t edge : *marked) forget_users(edge);
  make_children(index);
  return true;
}

void SplitMesh::make_children(std::uint32_t index) {
  leaves_[index].alive = 0;
  const SplitLeaf leaf = leaves_[index];
  const auto [a, b, c] = leaf.corner;
  const std::uint32_t ab = middle_vertex(leaf, a, b), bc = middle_vertex(leaf, b, c), ca = middle_vertex(leaf, c, a);
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
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) { return self.middle_vertex(leaf, a, b); }
  Vec3f position(std::uint32_t a) const { return self.mesh_.position[a]; }
  void emit(const Triangle& t) {
    out.mesh.triangles.push_back(t);
    out.mesh.part.push_back(leaf.part);
    out.depth.push_back(static_cast<std::uint8_t>(leaf.depth));
  }
};

ClosedMesh SplitMesh::close(std::size_t kept_vertices) {
  ClosedMesh out;
  out.mesh.triangles.reserve(closed_triangles_);
  out.mesh.part.reserve(closed_triangles_);
  out.depth.reserve(closed_triangles_);
  users_ = {};
  for (; !leaves_.empty(); leaves_.pop_front()) {  // each gives its memory to what comes out of it
    Emitter emitter{*this, leaves_.front(), out};
    if (leaves_.front().alive) close_triangle(leaves_.front().corner, emitter);
  }
  std::vector<bool> used(mesh_.position.size(), false);
  std::fill_n(used.begin(), kept_vertices, true);
  for (const Triangle& t : out.mesh.triangles) used[t[0]] = used[t[1]] = used[t[2]] = true;
  const std::vector<float> areas = areas_of_samples(out);
  const std::vector<std::uint32_t> renamed = keep_vertices(used, out);
  mesh_ = {};
  out.samples.reserve(
      static_cast<std::size_t>(std::count_if(areas.begin(), areas.end(), [](float a) { return a > 0; })));
  for (std::uint32_t m = 0; m < areas.size(); ++m) {
    if (areas[m] > 0) {
      out.samples.push_back({renamed[middles_[m].a], renamed[middles_[m].b], input_vertices_ + m, areas[m]});
    }
  }
  return out;
}

// Of each middle that did not become a vertex: the area of the triangles that its edge borders.
std::vector<float> SplitMesh::areas_of_samples(const ClosedMesh& closed) const {
  std::vector<float> areas(middles_.size(), 0.0F);
  for (const Triangle& t : closed.mesh.triangles) {
    const auto area = static_cast<float>(triangle_area(mesh_, t));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t m = find_middle(t[k], t[(k + 1) % 3]);
      if (m != kNone && middles_[m].vertex == kNone) areas[m] += area;
    }
  }
  return areas;
}

std::vector<std::uint32_t> SplitMesh::keep_vertices(const std::vector<bool>& used, ClosedMesh& out) const {
  std::vector<std::uint32_t> renamed(used.size(), kNone);
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v]) renamed[v] = count++;
  }
  const auto keep = [&](const auto& from, auto& to) {
    to.reserve(from.empty() ? 0 : count);
    for (std::size_t v = 0; v < from.size(); ++v) {
      if (used[v]) to.push_back(from[v]);
    }
  };
  keep(point_, out.point);
  keep(mesh_.position, out.mesh.position);
  keep(mesh_.normal, out.mesh.normal);
  keep(mesh_.uv0, out.mesh.uv0);
  keep(mesh_.uv1, out.mesh.uv1);
  keep(mesh_.color, out.mesh.color);
  keep(mesh_.tangent, out.mesh.tangent);
  for (Triangle& t : out.mesh.triangles) t = {renamed[t[0]], renamed[t[1]], renamed[t[2]]};
  return renamed;
}

}  // namespace kiln
