#include "core/meshless/points.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/point_grid.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr double kPointsPerDisk = 0.7;  // A / R^2 of a full level times this is its number of points
constexpr double kFewestWanted = 8192, kMostWanted = 262144;
constexpr int kAutoLevels = 5;

/// 0 where the triangle gets no points.
double area_of(const Mesh& mesh, const PointPlacement& placement, std::size_t t) {
  return placement.parts.empty() || placement.parts[mesh.part[t]] ? triangle_area(mesh, mesh.triangles[t]) : 0.0;
}

/// Triangles by area, in constant time: a guide table into the running sum.
class AreaSampler {
 public:
  AreaSampler(const Mesh& mesh, const PointPlacement& placement) {
    double sum = 0;
    cumulative_.reserve(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) cumulative_.push_back(sum += area_of(mesh, placement, t));
    guide_.reserve(cumulative_.size());
    std::uint32_t t = 0;
    for (std::size_t i = 0; i < cumulative_.size(); ++i) {
      while (cumulative_[t] <= total() * static_cast<double>(i) / static_cast<double>(cumulative_.size()) &&
             t + 1 < cumulative_.size()) {
        ++t;
      }
      guide_.push_back(t);
    }
  }
  double total() const { return cumulative_.empty() ? 0 : cumulative_.back(); }

  std::uint32_t pick(double u) const {
    const auto cell = static_cast<std::size_t>(u * static_cast<double>(guide_.size()));
    std::uint32_t t = guide_[std::min(cell, guide_.size() - 1)];
    while (t + 1 < cumulative_.size() && cumulative_[t] <= u * total()) ++t;
    return t;
  }

 private:
  std::vector<double> cumulative_;
  std::vector<std::uint32_t> guide_;
};

bool is_double_sided(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)].double_sided;
}

/// Equation 1.
bool has_room(const PointGrid& grid, const std::vector<MeshlessPoint>& points, const SurfaceSite& at, float radius) {
  bool room = true;
  grid.near(at.position, radius, [&](std::uint32_t id, float d2) {
    const SurfaceSite& q = points[id].site;
    const float reach = radius * std::max(0.0F, dot(q.normal, at.normal));
    if (q.group == at.group && d2 < reach * reach) room = false;
  });
  return room;
}

}  // namespace

double expected_points(double area, double radius) { return kPointsPerDisk * area / (radius * radius); }

double placed_area(const PointPlacement& placement, const Scene& scene) {
  double sum = 0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) sum += area_of(scene.mesh, placement, t);
  return sum;
}

PointPlacement resolve(const PointPlacement& asked, const Scene& scene) {
  PointPlacement out = asked;
  const double area = placed_area(asked, scene);
  if (out.levels <= 0) out.levels = kAutoLevels;
  if (out.wanted == 0) {
    const double half = 0.5 * static_cast<double>(scene.mesh.position.size());
    out.wanted = static_cast<std::uint64_t>(std::clamp(half, kFewestWanted, kMostWanted));
  }
  if (!(out.radius > 0)) {
    const double finest = std::sqrt(kPointsPerDisk * area / static_cast<double>(out.wanted));
    out.radius = static_cast<float>(std::max(finest, 1e-6) * std::exp2(out.levels - 1));
  }
  return out;
}

TransferPoint transfer_point(const MeshlessPoint& p) {
  return {p.site.position, p.site.normal, p.site.position, p.face_normal};
}

bool is_enclosed(const Tracer& tracer, const GatherFaces& faces, const TransferPoint& p, bool both_sides) {
  const Hit hit = tracer.closest(ray_origin(p), p.normal, kFar);
  if (!hit) return false;
  const HitSide side = faces.side(hit.triangle, p.normal);
  return both_sides ? side == HitSide::dark : side != HitSide::front;
}

MeshlessPoint point_on(const Scene& scene, std::uint32_t triangle, const Vec2f& uv, bool groups_by_part, bool behind) {
  const Mesh& mesh = scene.mesh;
  const Triangle& t = mesh.triangles[triangle];
  const float u = uv.x, v = uv.y, w = 1 - u - v;
  MeshlessPoint p{.triangle = triangle, .u = u, .v = v};
  p.site.position = mesh.position[t[0]] * w + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
  p.site.group = groups_by_part ? mesh.part[triangle] : 0;
  p.face_normal = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
  const Vec3f shading = mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]];
  if (is_double_sided(scene, triangle) && dot(p.face_normal, shading) < 0) p.face_normal = -p.face_normal;
  p.site.normal = normalized(mesh.normal[t[0]] * w + mesh.normal[t[1]] * u + mesh.normal[t[2]] * v, p.face_normal);
  if (dot(p.site.normal, p.face_normal) <= 0) p.site.normal = p.face_normal;  // a normal that contradicts its face
  if (behind) {
    p.site.normal = -p.site.normal;
    p.face_normal = -p.face_normal;
    p.behind = true;
  }
  return p;
}

PointHierarchy place_points(const Tracer& tracer, const GatherFaces& faces, const PointPlacement& asked,
                            Threads& threads) {
  const Scene& scene = tracer.scene();
  const PointPlacement params = resolve(asked, scene);
  EXPECTS(params.levels <= kMaxPointLevels && std::isfinite(params.radius));
  const AreaSampler triangles(scene.mesh, params);
  const bool two_sided = params.both_sides > 0;
  PointHierarchy out;
  if (!(triangles.total() > 0)) return out;
  EXPECTS(expected_points(triangles.total(), std::ldexp(params.radius, 1 - params.levels)) < 0x1p31);

  float radius = params.radius;
  for (int level = 0; level < params.levels; ++level, radius *= 0.5F) {
    PointGrid grid(2 * radius);
    for (std::uint32_t i = 0; i < out.points.size(); ++i) grid.add(i, out.points[i].site.position);
    Random random(params.seed, static_cast<std::uint64_t>(level));
    const bool both = level < params.both_sides;
    const double wanted = (both ? 2 : 1) * kProposals * triangles.total() / (double{radius} * radius);
    const auto proposals = static_cast<std::uint64_t>(std::ceil(wanted)) + kProposals;
    for (std::uint64_t k = 0; k < proposals; ++k) {
      if (k % 4096 == 0) threads.check();
      const std::uint32_t triangle = triangles.pick(random.uniform_double());
      const double a = random.uniform_double(), b = random.uniform_double();
      const Vec2<double> uv = uniform_triangle({a, b});
      const bool behind = both && is_double_sided(scene, triangle) && random.uniform() < 0.5F;
      const MeshlessPoint p = point_on(scene, triangle, {static_cast<float>(uv.x), static_cast<float>(uv.y)},
                                       params.groups_by_part, behind);
      if (!has_room(grid, out.points, p.site, radius)) continue;
      if (is_enclosed(tracer, faces, transfer_point(p), two_sided)) continue;
      grid.add(static_cast<std::uint32_t>(out.points.size()), p.site.position);
      out.points.push_back(p);
    }
    out.level_end.push_back(static_cast<std::uint32_t>(out.points.size()));
    out.radius.push_back(radius);
  }
  return out;
}

}  // namespace kiln
