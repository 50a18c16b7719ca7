#include "core/meshless/senders.h"

#include <algorithm>

#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr float kReach = 2;  // of R

bool is_double_sided(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)].double_sided;
}

float longest_edge(const Mesh& mesh, const Triangle& t) {
  float longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    longest = std::max(longest, length(mesh.position[t[k]] - mesh.position[t[(k + 1) % 3]]));
  }
  return longest;
}

}  // namespace

Senders::Senders(const Scene& scene, const PointHierarchy& points, bool groups_by_part, Threads& threads)
    : scene_(scene),
      points_(points),
      groups_by_part_(groups_by_part),
      finest_(points.radius.empty() ? 1.0F : points.radius.back()),
      grid_(2 * finest_) {
  for (std::uint32_t i = 0; i < points.points.size(); ++i) grid_.add(i, points.points[i].site.position);
  const Mesh& mesh = scene.mesh;
  of_face_.assign(mesh.triangles.size(), kLookUp);
  threads.for_blocks(mesh.triangles.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
      if (longest_edge(mesh, mesh.triangles[t]) > finest_) continue;
      of_face_[t] = nearest(site_on(t, 1.0F / 3, 1.0F / 3));
    }
  });
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

std::uint32_t Senders::at(std::uint32_t triangle, float u, float v) const {
  const std::uint32_t known = of_face_[triangle];
  return known == kLookUp ? nearest(site_on(triangle, u, v)) : known;
}

}  // namespace kiln
