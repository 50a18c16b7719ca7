#include "core/mesh/part_vertices.h"

#include <algorithm>
#include <span>

#include "core/mesh/midpoint.h"

namespace kiln {
namespace {

/// The triangles around each vertex.
class Fans {
 public:
  explicit Fans(const Mesh& mesh) : first_(mesh.position.size() + 1, 0), triangle_(3 * mesh.triangles.size()) {
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t v : t) ++first_[v + 1];
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) triangle_[next[v]++] = t;
  }
  std::span<const std::uint32_t> around(std::uint32_t v) const {
    return std::span(triangle_).subspan(first_[v], first_[v + 1] - first_[v]);
  }

 private:
  std::vector<std::uint32_t> first_, triangle_;
};

bool has(const Triangle& t, std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; }

/// Whether two triangles around v share an edge there that is none of `edges`.
bool joined(const std::vector<MeshEdge>& edges, std::uint32_t v, const Triangle& t, const Triangle& u) {
  return std::ranges::any_of(t, [&](std::uint32_t w) {
    return w != v && has(u, w) && !std::ranges::binary_search(edges, MeshEdge(std::minmax(v, w)));
  });
}

/// The triangles around a vertex, those together that no edge keeps apart.
std::vector<std::vector<std::uint32_t>> shares_of(const Mesh& mesh, std::span<const std::uint32_t> fan,
                                                  const std::vector<MeshEdge>& edges, std::uint32_t v) {
  std::vector<std::uint32_t> rest(fan.begin(), fan.end());
  std::vector<std::vector<std::uint32_t>> shares;
  while (!rest.empty()) {
    std::vector<std::uint32_t> share{rest.front()};
    rest.erase(rest.begin());
    for (std::size_t i = 0; i < share.size(); ++i) {
      std::erase_if(rest, [&](std::uint32_t t) {
        const bool mine = joined(edges, v, mesh.triangles[share[i]], mesh.triangles[t]);
        if (mine) share.push_back(t);
        return mine;
      });
    }
    shares.push_back(std::move(share));
  }
  return shares;
}

}  // namespace

void part_vertices(Mesh& mesh, const std::vector<MeshEdge>& edges) {
  std::vector<std::uint32_t> vertices;
  for (const auto& [a, b] : edges) vertices.insert(vertices.end(), {a, b});
  std::ranges::sort(vertices);
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());

  const Fans fans(mesh);
  std::vector<Triangle> renamed = mesh.triangles;  // together at the end: fans know the old names
  for (const std::uint32_t v : vertices) {
    const auto shares = shares_of(mesh, fans.around(v), edges, v);
    for (std::size_t s = 1; s < shares.size(); ++s) {
      const std::uint32_t copy = append_between(mesh, v, v, 0);
      for (const std::uint32_t t : shares[s]) std::ranges::replace(renamed[t], v, copy);
    }
  }
  mesh.triangles = std::move(renamed);
}

}  // namespace kiln
