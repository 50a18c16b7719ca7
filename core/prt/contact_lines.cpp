#include "core/prt/contact_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "core/mesh/box_tree.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr double kFlat = 0.05;  // sine of the angle below which two planes are one: tiles that overlap

/// Which triangles share an edge, by position.
class Neighbours {
 public:
  explicit Neighbours(const Mesh& mesh) : mesh_(mesh), place_(weld_by_position(mesh.position)) {
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) edges_.push_back(edge(t, k));
    }
    std::ranges::sort(edges_);
  }

  /// Whether t and u are the two sides of an edge that has no third.
  bool fold(const Triangle& t, const Triangle& u) const {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < 3; ++j) {
        if (edge(t, k) == edge(u, j) && sides(edge(t, k)) <= 2) return true;
      }
    }
    return false;
  }

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  Edge edge(const Triangle& t, std::size_t k) const { return std::minmax({place_[t[k]], place_[t[(k + 1) % 3]]}); }
  std::ptrdiff_t sides(const Edge& e) const {
    return std::upper_bound(edges_.begin(), edges_.end(), e) - std::lower_bound(edges_.begin(), edges_.end(), e);
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> place_;
  std::vector<Edge> edges_;
};

std::array<Vec3d, 3> corners(const Mesh& mesh, const Triangle& t) {
  return {to_double(mesh.position[t[0]]), to_double(mesh.position[t[1]]), to_double(mesh.position[t[2]])};
}

/// Where triangle `other` goes through the plane a hair above `plane`, on the side of its shading normals. There rays
/// start, so that they start on the right side of what leans. As long as the trace in the plane itself: those of two
/// triangles that share a corner in it meet.
std::optional<Segment> trace_of(const TrianglePlane& plane, double side, const std::array<Vec3d, 3>& other) {
  const Vec3d normal = normalized(cross(other[1] - other[0], other[2] - other[0]), plane.z);
  if (length(cross(normal, plane.z)) < kFlat) return std::nullopt;
  std::array<double, 3> height{};
  for (std::size_t k = 0; k < 3; ++k) height[k] = side * dot(other[k] - plane.origin, plane.z);
  if (std::ranges::max(height) < kHair || std::ranges::min(height) >= kHair) return std::nullopt;
  std::array<Vec2d, 2> end, foot;  // a hair above, and in the plane
  std::size_t found = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if ((height[k] < kHair) == (height[next] < kHair) || found == 2) continue;
    const auto at = [&](double h) {
      const double share = std::clamp((height[k] - h) / (height[k] - height[next]), 0.0, 1.0);
      return plane.flat(other[k] + (other[next] - other[k]) * share);
    };
    end[found] = at(kHair);
    foot[found++] = at(0);
  }
  const Vec2d way = end[1] - end[0];
  const double squared = dot(way, way);
  if (!(squared > 0)) return std::nullopt;
  const auto along = [&](const Vec2d& p) { return dot(p - end[0], way) / squared; };
  const double first = std::min(0.0, along(foot[0])), last = std::max(1.0, along(foot[1]));
  return Segment{end[0] + way * first, end[0] + way * last};
}

}  // namespace

std::vector<CutLine> find_contact_lines(const Mesh& mesh, const std::vector<bool>& stands, Threads& threads) {
  constexpr std::size_t kBlock = 256;
  const BoxTree tree(mesh);
  const Neighbours neighbours(mesh);
  const auto a_hair = static_cast<float>(kHair);
  const Vec3f hair{a_hair, a_hair, a_hair};
  std::vector<std::vector<CutLine>> of_block(mesh.triangles.size() / kBlock + 1);

  const auto find = [&](std::uint32_t index, std::vector<CutLine>& out) {
    const Triangle& t = mesh.triangles[index];
    const TrianglePlane plane(mesh, t);
    const std::array<Vec2d, 3> corner = flat_corners(mesh, t, plane);
    if (is_too_small(corner)) return;
    const double side = lit_side(mesh, t, plane);
    std::vector<CutLine> lines;
    Box near = triangle_box(mesh, t);
    near.add(near.low - hair);
    near.add(near.high + hair);
    tree.overlapping(near, [&](std::uint32_t other) {
      if (other == index || !stands[other]) return;
      const auto trace = trace_of(plane, side, corners(mesh, mesh.triangles[other]));
      const auto line = trace ? clipped(*trace, corner) : std::nullopt;
      if (line && length(line->b - line->a) > 2 * kSamePlace && !neighbours.fold(t, mesh.triangles[other]))
        lines.push_back({index, *line});
    });
    keep_longest(lines, most_lines(mesh));
    out.insert(out.end(), lines.begin(), lines.end());
  };
  threads.for_blocks(mesh.triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) find(static_cast<std::uint32_t>(t), of_block[begin / kBlock]);
  });
  std::vector<CutLine> out;
  for (const auto& block : of_block) out.insert(out.end(), block.begin(), block.end());
  return out;
}

}  // namespace kiln
