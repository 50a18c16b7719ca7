#include "core/mesh/closest_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/mesh/box_tree.h"

namespace kiln {
namespace {

std::array<Vec3d, 3> corners(const Mesh& mesh, std::uint32_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  return {to_double(mesh.position[t[0]]), to_double(mesh.position[t[1]]), to_double(mesh.position[t[2]])};
}

/// Barycentrics of the nearest point and its squared distance.
struct Nearest {
  double u = 0, v = 0, squared = HUGE_VAL;
};

Nearest nearest_on_edge(const std::array<Vec3d, 3>& c, std::size_t from, const Vec3d& p) {
  const std::size_t to = (from + 1) % 3;
  const Vec3d edge = c[to] - c[from];
  const double size = dot(edge, edge);
  const double t = size > 0 ? std::clamp(dot(p - c[from], edge) / size, 0.0, 1.0) : 0.0;
  const Vec3d offset = p - (c[from] + edge * t);
  std::array<double, 3> weight{};
  weight[from] = 1 - t;
  weight[to] = t;
  return {weight[1], weight[2], dot(offset, offset)};
}

/// Inside the prism over the triangle: its plane; else one of its edges.
Nearest nearest_on_triangle(const std::array<Vec3d, 3>& c, const Vec3d& p) {
  const Vec3d e1 = c[1] - c[0], e2 = c[2] - c[0], n = cross(e1, e2), d = p - c[0];
  const double area2 = dot(n, n);
  if (area2 > 0) {
    const double u = dot(cross(d, e2), n) / area2, v = dot(cross(e1, d), n) / area2;
    if (u >= 0 && v >= 0 && u + v <= 1) {
      const double height = dot(d, n);
      return {u, v, height * height / area2};
    }
  }
  Nearest best;
  for (std::size_t from = 0; from < 3; ++from) {
    const Nearest edge = nearest_on_edge(c, from, p);
    if (edge.squared < best.squared) best = edge;
  }
  return best;
}

Vec3d interpolate(const Mesh& mesh, const std::vector<Vec3f>& values, const SurfaceMatch& at) {
  const Triangle& t = mesh.triangles[at.triangle];
  return to_double(values[t[0]]) * (1 - at.u - at.v) + to_double(values[t[1]]) * at.u + to_double(values[t[2]]) * at.v;
}

}  // namespace

Vec3d match_normal(const Mesh& mesh, const SurfaceMatch& at) {
  return normalized(interpolate(mesh, mesh.normal, at), to_double(mesh.normal[mesh.triangles[at.triangle][0]]));
}

Vec3d match_position(const Mesh& mesh, const SurfaceMatch& at) { return interpolate(mesh, mesh.position, at); }

struct ClosestPoint::Tree {
  const Mesh& mesh;
  BoxTree boxes;

  explicit Tree(const Mesh& m) : mesh(m), boxes(m) {}

  /// Calls visit(triangle) for every triangle whose box is within sqrt(limit), near boxes first; visit may lower limit.
  template <class Visit>
  void within(const Vec3d& point, double& limit, const Visit& visit) const {
    const std::vector<BoxTree::Node>& nodes = boxes.nodes;
    if (nodes.empty()) return;
    std::array<std::uint32_t, BoxTree::kMostOpen> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const BoxTree::Node& node = nodes[stack[--top]];
      if (squared_distance(node.box, point) > limit) continue;
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(boxes.order[i]);
        continue;
      }
      const bool first_is_near =
          squared_distance(nodes[node.first].box, point) <= squared_distance(nodes[node.first + 1].box, point);
      stack[top++] = first_is_near ? node.first + 1 : node.first;
      stack[top++] = first_is_near ? node.first : node.first + 1;
    }
  }
};

ClosestPoint::ClosestPoint(const Mesh& mesh) : tree_(std::make_unique<Tree>(mesh)) {}
ClosestPoint::~ClosestPoint() = default;
ClosestPoint::ClosestPoint(ClosestPoint&&) noexcept = default;
ClosestPoint& ClosestPoint::operator=(ClosestPoint&&) noexcept = default;

std::optional<SurfaceMatch> ClosestPoint::query(const Vec3d& point, const Vec3d& normal, double reach) const {
  const Mesh& mesh = tree_->mesh;
  const bool any_normal = !(length(normal) > 0);
  const Vec3d wanted = normalized(normal);
  const auto agreement = [&](const SurfaceMatch& at) { return any_normal ? 1.0 : dot(match_normal(mesh, at), wanted); };
  const auto match = [&](std::uint32_t triangle) {
    const Nearest near = nearest_on_triangle(corners(mesh, triangle), point);
    return SurfaceMatch{triangle, near.u, near.v, std::sqrt(near.squared)};
  };

  // The least distance first.
  double limit = reach * reach;
  bool found = false;
  tree_->within(point, limit, [&](std::uint32_t triangle) {
    const SurfaceMatch at = match(triangle);
    if (at.distance * at.distance > limit || agreement(at) <= kCompatibleCosine) return;
    limit = at.distance * at.distance;
    found = true;
  });
  if (!found) return std::nullopt;

  // Then the best agreement among all at that distance.
  const double distance = std::sqrt(limit) + kSamePlace;
  limit = distance * distance;
  std::optional<SurfaceMatch> best;
  double best_agreement = 0;
  tree_->within(point, limit, [&](std::uint32_t triangle) {
    const SurfaceMatch at = match(triangle);
    const double agrees = agreement(at);
    if (at.distance > distance || agrees <= kCompatibleCosine) return;
    if (best && (agrees < best_agreement || (agrees == best_agreement && triangle > best->triangle))) return;
    best = at;
    best_agreement = agrees;
  });
  return best;
}

}  // namespace kiln
