#include "core/meshless/senders.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr float kReach = 2;            // of R
constexpr std::size_t kMostAsked = 8;  // of those within reach

bool is_double_sided(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)].double_sided;
}

constexpr float kMostCells = 16;  // for each R^2 of area, beside as many to begin with

/// Barycentrics of corners 1 and 2 from coordinates (a, b) along the edges from `corner`, and back.
Vec2f to_uv(std::uint8_t corner, float a, float b) {
  const float c = 1 - a - b;
  return corner == 0 ? Vec2f{a, b} : corner == 1 ? Vec2f{c, a} : Vec2f{b, c};
}
Vec2f from_uv(std::uint8_t corner, float u, float v) {
  const float w = 1 - u - v;
  return corner == 0 ? Vec2f{u, v} : corner == 1 ? Vec2f{v, w} : Vec2f{w, u};
}

}  // namespace

Senders::Senders(const Scene& scene, const PointHierarchy& points, const PointPlacement& placement, Threads& threads)
    : scene_(scene),
      points_(points),
      groups_by_part_(placement.groups_by_part),
      both_sides_(placement.both_sides > 0),
      finest_(points.radius.empty() ? 1.0F : points.radius.back()),
      grid_(2 * finest_) {
  for (std::uint32_t i = 0; i < points.points.size(); ++i) grid_.add(i, points.points[i].site.position);
  const std::size_t triangles = scene.mesh.triangles.size();
  faces_.resize(triangles);
  std::uint32_t cells = 0;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    faces_[t] = cut(t);
    faces_[t].begin = cells;
    cells += std::uint32_t{faces_[t].columns} * faces_[t].rows;
  }
  cells_.assign(cells, kNone);
  if (both_sides_) back_cells_.assign(cells, kNone);
  threads.for_blocks(triangles, kBlock, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) fill(t);
  });
}

/// The corner whose edges take the fewest cells.
Senders::Face Senders::cut(std::uint32_t triangle) const {
  const Mesh& mesh = scene_.mesh;
  const Triangle& t = mesh.triangles[triangle];
  Face best;
  float fewest = 0;
  for (std::uint8_t k = 0; k < 3; ++k) {
    const Vec3f& from = mesh.position[t[k]];
    const float columns = std::max(1.0F, std::ceil(length(mesh.position[t[(k + 1) % 3]] - from) / finest_));
    const float rows = std::max(1.0F, std::ceil(length(mesh.position[t[(k + 2) % 3]] - from) / finest_));
    if (fewest > 0 && columns * rows >= fewest) continue;
    fewest = columns * rows;
    if (columns > 65535 || rows > 65535) continue;
    best = {0, static_cast<std::uint16_t>(columns), static_cast<std::uint16_t>(rows), k};
  }
  const auto area = static_cast<float>(triangle_area(mesh, t));
  return fewest <= kMostCells * (1 + area / (finest_ * finest_)) ? best : Face{};
}

void Senders::fill(std::uint32_t triangle) {
  const Face& f = faces_[triangle];
  for (std::uint32_t j = 0; j < f.rows; ++j) {
    for (std::uint32_t i = 0; i < f.columns; ++i) {
      float a = (static_cast<float>(i) + 0.5F) / f.columns, b = (static_cast<float>(j) + 0.5F) / f.rows;
      if (const float sum = a + b; sum > 1) {
        if (static_cast<float>(i) / f.columns + static_cast<float>(j) / f.rows >= 1) break;  // outside, as all to come
        a /= sum, b /= sum;
      }
      const Vec2f uv = to_uv(f.corner, a, b);
      SurfaceSite site = site_on(triangle, uv.x, uv.y);
      const std::uint32_t cell = f.begin + j * f.columns + i;
      cells_[cell] = nearest(site);
      if (!both_sides_ || !is_double_sided(scene_, triangle)) continue;
      site.normal = -site.normal;
      back_cells_[cell] = nearest(site);
    }
  }
}

SurfaceSite Senders::site_on(std::uint32_t triangle, float u, float v) const {
  const Mesh& mesh = scene_.mesh;
  const Triangle& t = mesh.triangles[triangle];
  SurfaceSite site;
  site.position = mesh.position[t[0]] * (1 - u - v) + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
  site.normal = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
  const Vec3f shading = mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]];
  if (is_double_sided(scene_, triangle) && dot(site.normal, shading) < 0) site.normal = -site.normal;
  site.group = groups_by_part_ ? mesh.part[triangle] : 0;
  return site;
}

std::uint32_t Senders::nearest(const SurfaceSite& at) const {
  std::uint32_t best = kNone;
  for (const float reach : {finest_, kReach * finest_}) {
    float least = reach * reach;  // of d^2 / cos^2
    grid_.near(at.position, reach, [&](std::uint32_t i, float d2) {
      const SurfaceSite& q = points_.points[i].site;
      const float cosine = dot(q.normal, at.normal);
      if (q.group != at.group || cosine <= 0 || d2 > least * cosine * cosine) return;
      const float scaled = d2 / (cosine * cosine);
      if (scaled < least || i < best) best = i, least = std::min(least, scaled);
    });
    if (best != kNone) return best;
  }
  return kNone;
}

std::uint32_t Senders::nearest(const SurfaceSite& at, const std::function<bool(std::uint32_t)>& suits) const {
  struct Candidate {
    float scaled;
    std::uint32_t point;
  };
  std::vector<Candidate> found;
  const float reach = kReach * finest_;
  grid_.near(at.position, reach, [&](std::uint32_t i, float d2) {
    const SurfaceSite& q = points_.points[i].site;
    const float cosine = dot(q.normal, at.normal);
    if (q.group != at.group || cosine <= 0 || d2 > reach * reach * cosine * cosine) return;
    found.push_back({d2 / (cosine * cosine), i});
  });
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return a.scaled != b.scaled ? a.scaled < b.scaled : a.point < b.point;
  });
  if (found.size() > kMostAsked) found.resize(kMostAsked);
  for (const Candidate& c : found) {
    if (suits(c.point)) return c.point;
  }
  return kNone;
}

std::uint32_t Senders::at(std::uint32_t triangle, float u, float v) const {
  const Face& f = faces_[triangle];
  return f.columns == 0 ? nearest(site_on(triangle, u, v)) : cells_[cell_at(f, u, v)];
}

std::uint32_t Senders::behind(std::uint32_t triangle, float u, float v) const {
  if (!both_sides_) return kNone;
  const Face& f = faces_[triangle];
  if (f.columns > 0) return back_cells_[cell_at(f, u, v)];
  SurfaceSite site = site_on(triangle, u, v);
  site.normal = -site.normal;
  return nearest(site);
}

std::uint32_t Senders::cell_at(const Face& f, float u, float v) const {
  const Vec2f at = from_uv(f.corner, u, v);
  const auto cell = [](float x, std::uint16_t cells) {
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(x * cells), 0, cells - 1));
  };
  std::uint32_t i = cell(at.x, f.columns);
  const std::uint32_t j = cell(at.y, f.rows);
  // A hit on the far edge may round into a cell that is outside.
  while (i > 0 && i * f.rows + j * f.columns >= std::uint32_t{f.columns} * f.rows) --i;
  return f.begin + j * f.columns + i;
}

}  // namespace kiln
