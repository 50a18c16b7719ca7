#include "core/bake/merge_plan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/mesh/pieces.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

/// Unit sums of area vectors at positions; `place` as weld_by_position.
std::vector<Vec3d> even_normals(const Mesh& mesh, const std::vector<std::uint32_t>& place) {
  std::vector<Vec3d> sum(place.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) sum[place[v]] += to_double(area_vector(mesh, t));
  std::vector<Vec3d> out;
  for (std::size_t v = 0; v < place.size(); ++v) out.push_back(normalized(sum[place[v]], Vec3d{}));
  return out;
}

/// Of each position, whether its vertices' normals differ.
std::vector<bool> creased(const Mesh& mesh, const std::vector<std::uint32_t>& place) {
  constexpr float kDegree = 0.0175F;
  std::vector<bool> out(place.size());
  for (std::size_t v = 0; v < place.size(); ++v)
    if (length(mesh.normal[v] - mesh.normal[place[v]]) > kDegree) out[place[v]] = true;
  return out;
}

}  // namespace

std::uint64_t triangles_for_shape(const Mesh& mesh, double max_reach) {
  constexpr double kLongest = 100;  // squared, times the short side: collapses make no longer triangles
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  const std::vector<Vec3d> normal = even_normals(mesh, place);
  const std::vector<bool> crease = creased(mesh, place);
  const std::vector<float> diagonal = piece_diagonals(mesh);
  double needed = 0;
  for (const Triangle& t : mesh.triangles) {
    std::array<double, 3> curvature{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const double edge = length(to_double(mesh.position[b]) - to_double(mesh.position[a]));
      if (edge > 0) curvature[k] = length(normal[b] - normal[a]) / edge;
    }
    const auto [least, most] = std::ranges::minmax(curvature);
    const double both = std::sqrt(most * std::max(least, most / kLongest));
    const double allowed = std::sqrt(3.0) / 4 * 8 * max_reach * double{diagonal[t[0]]};  // times `both`
    const auto creases = std::ranges::count_if(t, [&](std::uint32_t v) { return bool{crease[place[v]]}; });
    needed += creases > 1 ? 1.0 : std::min(1.0, allowed > 0 ? triangle_area(mesh, t) * both / allowed : 1.0);
  }
  return static_cast<std::uint64_t>(std::ceil(std::max(needed, std::min(2.0, double(mesh.triangles.size())))));
}

}  // namespace kiln
