#include "core/meshless/point_field.h"

#include "core/base/expects.h"

namespace kiln {

PointField make_point_field(const PointHierarchy& points, std::span<const Vec3f> light, Threads& threads) {
  EXPECTS(light.size() == points.points.size());
  PointField out;
  for (std::size_t level = 0; level < points.placed_levels(); ++level) {
    for (std::uint32_t p = points.begin(level); p < points.level_end[level]; ++p) {
      const SurfaceSite& site = points.points[p].site;
      out.sites.push_back({site.position, pack_normal(site.normal), static_cast<std::uint8_t>(level)});
    }
    out.level_end.push_back(points.level_end[level]);
  }
  const MeshlessBasis basis = basis_of(out, threads);
  for (std::uint32_t j = 0; j < basis.functions(); ++j) out.radius.push_back(basis.radius(j));
  out.coefficients = basis.coefficients(light.first(out.sites.size()), threads);
  return out;
}

MeshlessBasis basis_of(const PointField& field, Threads& threads) {
  std::vector<SurfaceSite> sites;
  for (const RowSite& s : field.sites) sites.push_back({s.position, unpack_normal(s.normal), 0});
  return {sites, field.level_end, threads};
}

}  // namespace kiln
