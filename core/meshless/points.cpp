#include "core/meshless/points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/cover.h"
#include "core/meshless/point_grid.h"
#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr double kPointsPerDisk = 0.7;  // A / R^2 of a full level times this is its number of points
constexpr double kFewestWanted = 8192, kMostWanted = 262144;
constexpr int kAutoLevels = 5;

/// Of each triangle; 0 where it gets no points.
std::vector<double> areas_of(const Mesh& mesh, const PointPlacement& placement) {
  std::vector<double> out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const bool wanted = placement.parts.empty() || placement.parts[mesh.part[t]];
    out.push_back(wanted ? triangle_area(mesh, mesh.triangles[t]) : 0.0);
  }
  return out;
}

/// Triangles by area, in constant time: a guide table into the running sum.
class AreaSampler {
 public:
  explicit AreaSampler(std::span<const double> areas) {
    double sum = 0;
    cumulative_.reserve(areas.size());
    for (const double area : areas) cumulative_.push_back(sum += area);
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

/// Equation 1: whether a site would have room, for each group.
std::array<bool, kGroups> rooms(const PointGrid& grid, const std::vector<MeshlessPoint>& points, const SurfaceSite& at,
                                float radius) {
  std::array<bool, kGroups> room;
  room.fill(true);
  grid.near(at.position, radius, [&](std::uint32_t id, float d2) {
    const SurfaceSite& q = points[id].site;
    const float reach = radius * std::max(0.0F, dot(q.normal, at.normal));
    if (d2 < reach * reach) room[q.group] = false;
  });
  return room;
}

/// Barycentrics that are uniform by area where (a, b) is uniform.
Vec2f even_uv(double a, double b) {
  const Vec2<double> uv = uniform_triangle({a, b});
  return {static_cast<float>(uv.x), static_cast<float>(uv.y)};
}

/// Areas of the triangles that are covered somewhere on the given side, as far as one look for each R^2 tells; 0 of the
/// others, and of backs that are dark.
std::vector<double> covered_areas(const Tracer& tracer, std::vector<double> areas, float cover, bool behind,
                                  Threads& threads) {
  const Scene& scene = tracer.scene();
  constexpr int kMostLooks = 1 << 16;
  const auto is_covered = [&](std::uint32_t t) {
    if (behind && !is_double_sided(scene, t)) return false;
    const int looks = static_cast<int>(std::min<double>(kMostLooks, std::ceil(areas[t] / (double{cover} * cover))));
    for (int k = 0; k < looks; ++k) {
      const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), mix64(t));
      const MeshlessPoint p = point_on(scene, t, even_uv(u.x, u.y), behind);
      if (group_of(tracer, transfer_point(p), cover) == kCoveredGroup) return true;
    }
    return false;
  };
  threads.for_blocks(areas.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) areas[t] = is_covered(static_cast<std::uint32_t>(t)) ? areas[t] : 0;
  });
  return areas;
}

/// One level in the making: proposals are kept where there is room.
class Level {
 public:
  struct Surface {
    const Tracer& tracer;
    const GatherFaces& faces;
    bool two_sided;
    std::span<const double> covered;  // areas of triangles whose fronts are covered somewhere
  };
  Level(const Surface& surface, PointHierarchy& out, float radius)
      : surface_(surface), out_(out), radius_(radius), grid_(2 * radius) {
    for (std::uint32_t i = 0; i < out.points.size(); ++i) grid_.add(i, out.points[i].site.position);
  }

  enum class Side { front, both, covered_back };
  void propose(const AreaSampler& triangles, Side side, Random random, Threads& threads) {
    const double wanted = (side == Side::both ? 2 : 1) * kProposals * triangles.total() / (double{radius_} * radius_);
    const auto proposals = static_cast<std::uint64_t>(std::ceil(wanted)) + kProposals;
    for (std::uint64_t k = 0; k < proposals; ++k) {
      if (k % 4096 == 0) threads.check();
      const std::uint32_t triangle = triangles.pick(random.uniform_double());
      const double a = random.uniform_double(), b = random.uniform_double();
      const Vec2f uv = even_uv(a, b);
      const bool behind =
          side == Side::covered_back ||
          (side == Side::both && is_double_sided(surface_.tracer.scene(), triangle) && random.uniform() < 0.5F);
      consider(point_on(surface_.tracer.scene(), triangle, uv, behind), side);
    }
  }

 private:
  void consider(MeshlessPoint p, Side side) {
    const bool may_be_covered = side != Side::front || surface_.covered[p.triangle] > 0;
    const std::array<bool, kGroups> room = rooms(grid_, out_.points, p.site, radius_);
    if (!(may_be_covered && room[kCoveredGroup]) && (side == Side::covered_back || !room[kOpenGroup])) return;
    p.site.group = group_of(surface_.tracer, transfer_point(p), out_.cover);
    const bool covered = p.site.group == kCoveredGroup;
    if (!room[p.site.group] || (side == Side::covered_back && !covered)) return;
    if (is_enclosed(surface_.tracer, surface_.faces, transfer_point(p), surface_.two_sided || covered)) return;
    grid_.add(static_cast<std::uint32_t>(out_.points.size()), p.site.position);
    out_.points.push_back(p);
  }

  const Surface& surface_;
  PointHierarchy& out_;
  float radius_;
  PointGrid grid_;
};

}  // namespace

double expected_points(double area, double radius) { return kPointsPerDisk * area / (radius * radius); }

double placed_area(const PointPlacement& placement, const Scene& scene) {
  const std::vector<double> areas = areas_of(scene.mesh, placement);
  return std::accumulate(areas.begin(), areas.end(), 0.0);
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

MeshlessPoint point_on(const Scene& scene, std::uint32_t triangle, const Vec2f& uv, bool behind) {
  const Mesh& mesh = scene.mesh;
  const Triangle& t = mesh.triangles[triangle];
  const float u = uv.x, v = uv.y, w = 1 - u - v;
  MeshlessPoint p{.triangle = triangle, .u = u, .v = v};
  p.site.position = mesh.position[t[0]] * w + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
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

std::vector<std::uint32_t> level_sizes(const PointHierarchy& points) {
  std::vector<std::uint32_t> out;
  for (std::size_t level = 0; level < points.levels(); ++level)
    out.push_back(points.level_end[level] - points.begin(level));
  return out;
}

std::vector<std::uint32_t> count_by_level(const PointHierarchy& points, std::span<const std::uint32_t> some) {
  const std::vector<std::uint32_t>& ends = points.level_end;
  std::vector<std::uint32_t> out(ends.size());
  for (const std::uint32_t p : some) ++out[static_cast<std::size_t>(std::ranges::upper_bound(ends, p) - ends.begin())];
  return out;
}

std::vector<std::uint32_t> along_curve(const PointHierarchy& points, std::span<const std::uint32_t> some) {
  std::vector<Vec3f> positions;
  for (const std::uint32_t p : some) positions.push_back(points.points[p].site.position);
  std::vector<std::uint32_t> out;
  for (const std::uint32_t i : morton_order(positions)) out.push_back(some[i]);
  return out;
}

PointHierarchy place_points(const Tracer& tracer, const GatherFaces& faces, const PointPlacement& asked,
                            Threads& threads) {
  const Scene& scene = tracer.scene();
  const PointPlacement params = resolve(asked, scene);
  EXPECTS(params.levels <= kMaxPointLevels && std::isfinite(params.radius));
  const std::vector<double> areas = areas_of(scene.mesh, params);
  const AreaSampler triangles(areas);
  PointHierarchy out;
  if (!(triangles.total() > 0)) return out;
  out.cover = std::ldexp(params.radius, 1 - params.levels);
  EXPECTS(expected_points(triangles.total(), out.cover) < 0x1p31);
  const AreaSampler backs(covered_areas(tracer, areas, out.cover, true, threads));
  const std::vector<double> covered = covered_areas(tracer, areas, out.cover, false, threads);
  const Level::Surface surface{tracer, faces, params.both_sides > 0, covered};

  float radius = params.radius;
  for (int i = 0; i < params.levels; ++i, radius *= 0.5F) {
    Level level(surface, out, radius);
    const bool both = i < params.both_sides;
    const auto stream = static_cast<std::uint64_t>(i);
    level.propose(triangles, both ? Level::Side::both : Level::Side::front, Random(params.seed, stream), threads);
    if (!both && backs.total() > 0)
      level.propose(backs, Level::Side::covered_back, Random(params.seed, stream, 1), threads);
    out.level_end.push_back(static_cast<std::uint32_t>(out.points.size()));
    out.radius.push_back(radius);
  }
  return out;
}

}  // namespace kiln
