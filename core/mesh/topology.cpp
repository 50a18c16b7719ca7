#include "core/mesh/topology.h"

#include "core/mesh/welder.h"

namespace kiln {

std::vector<std::uint32_t> weld_by_position(const std::vector<Vec3f>& position) {
  Welder welder;
  std::vector<std::uint32_t> weld(position.size());
  for (std::uint32_t v = 0; v < position.size(); ++v) weld[v] = welder.weld(position[v], v);
  return weld;
}

Vec3f area_vector(const Mesh& mesh, const Triangle& t) {
  return cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]);
}

Vec3f centroid(const Mesh& mesh, const Triangle& t) {
  return (mesh.position[t[0]] + mesh.position[t[1]] + mesh.position[t[2]]) / 3.0F;
}

double triangle_area(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = to_double(mesh.position[t[0]]);
  return 0.5 * length(cross(to_double(mesh.position[t[1]]) - a, to_double(mesh.position[t[2]]) - a));
}

double surface_area(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += triangle_area(mesh, t);
  return sum;
}

}  // namespace kiln
