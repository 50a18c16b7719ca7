#include "core/prt/transfer_point.h"

#include "core/mesh/topology.h"

namespace kiln {
namespace {

// The angle of a triangle at its corner k.
float angle_at(const Mesh& mesh, const Triangle& t, std::size_t k) {
  const Vec3f a = mesh.position[t[(k + 1) % 3]] - mesh.position[t[k]];
  const Vec3f b = mesh.position[t[(k + 2) % 3]] - mesh.position[t[k]];
  return std::atan2(length(cross(a, b)), dot(a, b));
}

/// Halfway from corner k to the other side of the triangle.
Vec3f along_bisector(const Mesh& mesh, const Triangle& t, std::size_t k) {
  const Vec3f at = mesh.position[t[k]], a = mesh.position[t[(k + 1) % 3]] - at, b = mesh.position[t[(k + 2) % 3]] - at;
  const float to_a = length(a), to_b = length(b);
  return at + (a * to_b + b * to_a) / (2 * (to_a + to_b));
}

}  // namespace

std::vector<std::uint32_t> widest_faces(const Mesh& mesh) {
  std::vector<std::uint32_t> face(mesh.position.size(), kNoFace);
  std::vector<float> widest(mesh.position.size(), 0.0F);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corner = mesh.triangles[t];
    if (length(area_vector(mesh, corner)) == 0.0F) continue;  // no direction to lean to
    for (std::size_t k = 0; k < 3; ++k) {
      const float angle = angle_at(mesh, corner, k);
      if (angle <= widest[corner[k]]) continue;
      widest[corner[k]] = angle;
      face[corner[k]] = t;
    }
  }
  return face;
}

TransferPoint vertex_point(const Mesh& mesh, std::uint32_t vertex, std::uint32_t face) {
  TransferPoint point{mesh.position[vertex], mesh.normal[vertex], mesh.position[vertex], mesh.normal[vertex]};
  if (face == kNoFace) return point;
  const Triangle& t = mesh.triangles[face];
  point.inward = along_bisector(mesh, t, t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2);
  point.face_normal = normalized(area_vector(mesh, t), mesh.normal[vertex]);
  return point;
}

TransferPoint edge_point(const Mesh& mesh, const Triangle& face, std::uint32_t a, std::uint32_t b, float share) {
  const Vec3f from = mesh.position[a], way = mesh.position[b] - from, at = from + way * share;
  const Vec3f normal = normalized(mesh.normal[a] * (1 - share) + mesh.normal[b] * share, mesh.normal[a]);
  TransferPoint point{at, normal, at, normalized(area_vector(mesh, face), normal)};

  // The corner farthest from the edge's line, and its foot there as a share of the way: the edge may be part of a side.
  float foot = 0;
  Vec3f away{};
  for (const std::uint32_t corner : face) {
    const Vec3f to_corner = mesh.position[corner] - from;
    const float along = dot(to_corner, way) / dot(way, way);
    const Vec3f off = to_corner - way * along;
    if (dot(off, off) > dot(away, away)) away = off, foot = along;
  }
  // Straight away from the edge until the side that the apex leans from.
  const float reach = foot > share ? share / foot : (1 - share) / (1 - foot);
  if (is_finite(away) && std::isfinite(reach)) point.inward = at + away * (0.5F * reach);
  return point;
}

std::vector<TransferPoint> vertex_points(const Mesh& mesh) {
  const std::vector<std::uint32_t> face = widest_faces(mesh);
  std::vector<TransferPoint> points;
  points.reserve(face.size());
  for (std::uint32_t v = 0; v < face.size(); ++v) points.push_back(vertex_point(mesh, v, face[v]));
  return points;
}

}  // namespace kiln
