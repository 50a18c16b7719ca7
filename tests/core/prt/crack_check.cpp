#include "tests/core/prt/crack_check.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "core/base/random.h"
#include "core/mesh/midpoint.h"
#include "core/mesh/welder.h"

namespace kiln::testing {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

struct EdgeHash {
  std::size_t operator()(const Edge& e) const { return mix64(std::uint64_t{e.first} << 32 | e.second); }
};
using EdgeCount = std::unordered_map<Edge, int, EdgeHash>;

struct Edges {
  Welder welder;
  std::vector<Vec3f> point;

  std::uint32_t id(const Vec3f& p) {
    const auto fresh = static_cast<std::uint32_t>(point.size());
    const std::uint32_t found = welder.weld(p, fresh);
    if (found == fresh) point.push_back(p);
    return found;
  }

  // Triangles on each edge; edges whose ends coincide have no length and are left out.
  EdgeCount count(const Mesh& mesh) {
    EdgeCount result;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = id(mesh.position[t[k]]), b = id(mesh.position[t[(k + 1) % 3]]);
        if (a != b) ++result[std::minmax(a, b)];
      }
    }
    return result;
  }
};

// Whether pieces in `after` make up the edge, cut at exact middles.
bool covered(Edges& edges, const EdgeCount& after, const Edge& edge) {
  if (after.contains(edge)) return true;
  const std::size_t known = edges.point.size();
  const std::uint32_t middle = edges.id(kiln::middle(edges.point[edge.first], edges.point[edge.second]));
  return middle < known && middle != edge.first && middle != edge.second &&
         covered(edges, after, std::minmax(edge.first, middle)) &&
         covered(edges, after, std::minmax(middle, edge.second));
}

std::string name(const Edges& edges, const Edge& e) {
  const Vec3f a = edges.point[e.first], b = edges.point[e.second];
  const auto text = [](const Vec3f& p) {
    return "(" + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) + ")";
  };
  return text(a) + " - " + text(b);
}

}  // namespace

std::string find_crack(const Mesh& input, const Mesh& output) {
  Edges edges;
  const EdgeCount before = edges.count(input), after = edges.count(output);

  // What each piece of an input edge must carry: the triangles of all input edges it is a piece of.
  EdgeCount expected;
  std::vector<std::pair<Edge, int>> open(before.begin(), before.end());
  while (!open.empty()) {
    const auto [edge, triangles] = open.back();
    open.pop_back();
    const std::uint32_t middle = edges.id(kiln::middle(edges.point[edge.first], edges.point[edge.second]));
    const bool cut = middle != edge.first && middle != edge.second &&
                     covered(edges, after, std::minmax(edge.first, middle)) &&
                     covered(edges, after, std::minmax(middle, edge.second));
    if (!after.contains(edge)) {
      if (!cut) return "an input edge is lost: " + name(edges, edge);
      open.push_back({std::minmax(edge.first, middle), triangles});
      open.push_back({std::minmax(middle, edge.second), triangles});
    } else {
      if (cut && !covered(edges, before, std::minmax(edge.first, middle))) return "whole and cut: " + name(edges, edge);
      expected[edge] += triangles;
    }
  }
  for (const auto& [edge, triangles] : after) {
    const auto found = expected.find(edge);
    const int on_border = found == expected.end() ? 0 : found->second;
    if (triangles < on_border) return "an edge misses a triangle: " + name(edges, edge);
    if ((triangles - on_border) % 2 != 0) return "an inner edge has one side: " + name(edges, edge);
  }
  return {};
}

}  // namespace kiln::testing
