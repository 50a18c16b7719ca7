#include "core/prt/contact_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "core/mesh/box_tree.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr double kHair = 0x1p-19;  // unit cube: the height at which rays start (offset_origin)
constexpr double kFlat = 0.05;     // sine of the angle below which two planes are one: tiles that overlap
constexpr std::size_t kMostLines = 256, kFewestLines = 8, kAllLines = 1U << 22U;  // of a triangle; about so many in all

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

/// The part of a segment inside a triangle that is kSamePlace larger all around.
std::optional<Segment> clipped(const Segment& s, const std::array<Vec2d, 3>& corner) {
  double first = 0, last = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d way = corner[(k + 1) % 3] - corner[k];
    const auto inside = [&](const Vec2d& at) { return cross(way, at - corner[k]) / length(way) + 0.5 * kSamePlace; };
    const double a = inside(s.a), b = inside(s.b);
    if (a < 0 && b < 0) return std::nullopt;
    if (a < 0) first = std::max(first, a / (a - b));
    if (b < 0) last = std::min(last, a / (a - b));
  }
  if (first >= last) return std::nullopt;
  return Segment{s.a + (s.b - s.a) * first, s.a + (s.b - s.a) * last};
}

/// The side of a triangle towards which its vertices' normals point.
double lit_side(const Mesh& mesh, const Triangle& t, const TrianglePlane& plane) {
  return dot(to_double(mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]), plane.z) < 0 ? -1 : 1;
}

bool is_too_small(const std::array<Vec2d, 3>& corner) {
  const Vec2d b = corner[1] - corner[0], c = corner[2] - corner[0];
  return !(cross(b, c) > 16 * kSamePlace * std::max({length(b), length(c), length(c - b)}));  // its smallest height
}

}  // namespace

double length(const ContactLine& c) { return length(c.line.b - c.line.a); }

TrianglePlane::TrianglePlane(const Mesh& mesh, const Triangle& t) {
  const auto [a, b, c] = corners(mesh, t);
  origin = a;
  x = normalized(b - a);
  z = normalized(cross(b - a, c - a));
  y = cross(z, x);
}

std::vector<ContactLine> find_contact_lines(const Mesh& mesh, const std::vector<bool>& stands, Threads& threads) {
  constexpr std::size_t kBlock = 256;
  const std::size_t most =
      std::clamp(kAllLines / std::max<std::size_t>(1, mesh.triangles.size()), kFewestLines, kMostLines);
  const BoxTree tree(mesh);
  const Neighbours neighbours(mesh);
  const auto a_hair = static_cast<float>(kHair);
  const Vec3f hair{a_hair, a_hair, a_hair};
  std::vector<std::vector<ContactLine>> of_block(mesh.triangles.size() / kBlock + 1);

  const auto find = [&](std::uint32_t index, std::vector<ContactLine>& out) {
    const Triangle& t = mesh.triangles[index];
    const TrianglePlane plane(mesh, t);
    const auto [a, b, c] = corners(mesh, t);
    const std::array<Vec2d, 3> corner{plane.flat(a), plane.flat(b), plane.flat(c)};
    if (is_too_small(corner)) return;
    const double side = lit_side(mesh, t, plane);
    std::vector<ContactLine> lines;
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
    const auto key = [](const ContactLine& l) { return std::tuple(-length(l), l.line.a.x, l.line.a.y); };
    std::ranges::sort(lines, {}, key);
    lines.resize(std::min(lines.size(), most));
    out.insert(out.end(), lines.begin(), lines.end());
  };
  threads.for_blocks(mesh.triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) find(static_cast<std::uint32_t>(t), of_block[begin / kBlock]);
  });
  std::vector<ContactLine> out;
  for (const auto& block : of_block) out.insert(out.end(), block.begin(), block.end());
  return out;
}

std::array<TransferPoint, 2> beside_line(const Mesh& mesh, const ContactLine& contact) {
  constexpr double kClear = 3e-5;
  const Triangle& t = mesh.triangles[contact.triangle];
  const TrianglePlane plane(mesh, t);
  const Segment& s = contact.line;
  const Vec2d middle = (s.a + s.b) * 0.5, along = (s.b - s.a) * (kClear / length(contact));
  const Vec2d off{-along.y, along.x};
  const Vec3f face = to_float(plane.z * lit_side(mesh, t, plane));
  std::array<TransferPoint, 2> out;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3f at = to_float(plane.in_space(middle + off * (k == 0 ? -1 : 1)));
    out[k] = {.position = at, .normal = face, .inward = at, .face_normal = face};
  }
  return out;
}

}  // namespace kiln
