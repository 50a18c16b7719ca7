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
  point.inward = (mesh.position[t[0]] + mesh.position[t[1]] + mesh.position[t[2]]) / 3.0F;
  point.face_normal = normalized(area_vector(mesh, t), mesh.normal[vertex]);
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
