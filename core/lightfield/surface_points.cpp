#include "core/lightfield/surface_points.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "core/mesh/topology.h"

namespace kiln {
namespace {

/// The edge from corner c of triangle t to the next corner. `corner` is 3 t + c.
struct HalfEdge {
  std::uint32_t low, high;  // places in space
  std::uint32_t v, w;       // vertices at them
  std::uint32_t corner;
  bool up;  // runs from low to high
};

std::uint32_t next_corner(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

void drop_bad_triangles(Mesh& mesh, const std::vector<std::uint32_t>& place) {
  const auto turned = [](Triangle t) {  // the least vertex first
    std::rotate(t.begin(), std::ranges::min_element(t), t.end());
    return t;
  };
  std::vector<std::uint32_t> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](std::uint32_t t) { return std::pair(turned(mesh.triangles[t]), t); });
  std::vector<bool> bad(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[order[i]];
    const bool flat = place[a] == place[b] || place[b] == place[c] || place[c] == place[a];
    bad[order[i]] = flat || (i > 0 && turned(mesh.triangles[order[i]]) == turned(mesh.triangles[order[i - 1]]));
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < bad.size(); ++t) {
    if (bad[t]) continue;
    if (!mesh.part.empty()) mesh.part[kept] = mesh.part[t];
    mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  if (!mesh.part.empty()) mesh.part.resize(kept);
}

class Gluer {
 public:
  Gluer(const Mesh& mesh, const std::vector<std::uint32_t>& place) : mesh_(mesh), fan_(3 * mesh.triangles.size()) {
    std::iota(fan_.begin(), fan_.end(), 0U);
    stuck_.assign(fan_.size(), false);
    std::vector<HalfEdge> edges;
    edges.reserve(fan_.size());
    for (std::uint32_t corner = 0; corner < fan_.size(); ++corner) {
      const std::uint32_t v = vertex(corner), w = vertex(next_corner(corner));
      const bool up = place[v] < place[w];
      edges.push_back({std::min(place[v], place[w]), std::max(place[v], place[w]), up ? v : w, up ? w : v, corner, up});
    }
    std::ranges::sort(edges, {}, [](const HalfEdge& e) { return std::tuple(e.low, e.high, e.v, e.w, e.up, e.corner); });
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
      while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
      glue_edge({edges.begin() + static_cast<std::ptrdiff_t>(begin), edges.begin() + static_cast<std::ptrdiff_t>(end)});
    }
  }

  std::uint32_t fan(std::uint32_t corner) {
    while (fan_[corner] != corner) corner = fan_[corner] = fan_[fan_[corner]];
    return corner;
  }
  bool stuck(std::uint32_t corner) const { return stuck_[corner]; }

 private:
  std::uint32_t vertex(std::uint32_t corner) const { return mesh_.triangles[corner / 3][corner % 3]; }

  /// All triangles on one edge in space, those with the same vertices next to each other.
  void glue_edge(std::vector<HalfEdge> edges) {
    std::vector<HalfEdge> rest;
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
      while (end < edges.size() && edges[end].v == edges[begin].v && edges[end].w == edges[begin].w) ++end;
      if (end == begin + 2 && edges[begin].up != edges[begin + 1].up)
        glue(edges[begin], edges[begin + 1]);
      else
        rest.insert(rest.end(), edges.begin() + static_cast<std::ptrdiff_t>(begin),
                    edges.begin() + static_cast<std::ptrdiff_t>(end));
    }
    if (rest.size() == 2 && rest[0].up != rest[1].up) {
      glue(rest[0], rest[1]);
    } else if (rest.size() > 1) {
      glue_what_goes_on(rest);
      for (const HalfEdge& e : rest) stuck_[e.corner] = stuck_[next_corner(e.corner)] = true;
    }
  }
  /// Two that run on into each other are one sheet, whatever else touches it there.
  void glue_what_goes_on(std::vector<HalfEdge>& edges) {
    constexpr double kFlat = 0.7;     // cosine between their normals
    constexpr std::size_t kMost = 8;  // of more nobody can tell
    while (edges.size() > 1 && edges.size() <= kMost) {
      std::pair<std::size_t, std::size_t> which;
      double best = -1;
      for (std::size_t i = 0; i < edges.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
          if (edges[i].up == edges[k].up) continue;
          const double flat = dot(normal(edges[i]), normal(edges[k]));
          if (flat > best) best = flat, which = {i, k};
        }
      }
      if (best < kFlat) return;
      glue(edges[which.first], edges[which.second]);
      edges.erase(edges.begin() + static_cast<std::ptrdiff_t>(which.first));  // the later one
      edges.erase(edges.begin() + static_cast<std::ptrdiff_t>(which.second));
    }
  }
  Vec3d normal(const HalfEdge& e) const {
    return normalized(to_double(area_vector(mesh_, mesh_.triangles[e.corner / 3])));
  }
  /// They run in opposite directions: where one begins the other ends.
  void glue(const HalfEdge& a, const HalfEdge& b) {
    join(a.corner, next_corner(b.corner));
    join(next_corner(a.corner), b.corner);
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = fan(a), b = fan(b);
    fan_[std::max(a, b)] = std::min(a, b);
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> fan_;  // of corners, union by lowest
  std::vector<bool> stuck_;
};

}  // namespace

SurfacePoints find_surface_points(LitMesh& lit) {
  const std::vector<std::uint32_t> place = weld_by_position(lit.mesh.position);
  drop_bad_triangles(lit.mesh, place);
  Gluer gluer(lit.mesh, place);

  const std::size_t corners = 3 * lit.mesh.triangles.size();
  SurfacePoints out;
  out.point.assign(lit.mesh.position.size(), SurfacePoints::kNone);
  std::vector<std::uint32_t> number(corners, SurfacePoints::kNone), fan_of_vertex = out.point;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> copies;  // (vertex, fan), corner
  for (std::uint32_t corner = 0; corner < corners; ++corner) {
    const std::uint32_t fan = gluer.fan(corner), v = lit.mesh.triangles[corner / 3][corner % 3];
    if (number[fan] == SurfacePoints::kNone) {
      number[fan] = static_cast<std::uint32_t>(out.locked.size());
      out.locked.push_back(false);
    }
    if (gluer.stuck(corner)) out.locked[number[fan]] = true;
    if (fan_of_vertex[v] == SurfacePoints::kNone) fan_of_vertex[v] = fan, out.point[v] = number[fan];
    if (fan_of_vertex[v] != fan) copies.emplace_back((std::uint64_t{v} << 32) | fan, corner);
  }
  std::ranges::sort(copies);
  std::uint32_t copy = 0;
  for (std::size_t i = 0; i < copies.size(); ++i) {
    const auto& [key, corner] = copies[i];
    if (i == 0 || copies[i - 1].first != key) {
      copy = append_vertex(lit, lit, static_cast<std::uint32_t>(key >> 32));
      out.point.push_back(number[static_cast<std::uint32_t>(key)]);
    }
    lit.mesh.triangles[corner / 3][corner % 3] = copy;
  }
  return out;
}

}  // namespace kiln
