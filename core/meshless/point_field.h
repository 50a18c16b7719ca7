#pragma once
// The light of a radiosity solution as the hierarchy itself holds it: points on levels, and coefficients of the basis.
//   F(p) = sum_j a_j B_j(p)                                                                  (basis.h, equation 9)
// Sites are those that files hold (positions in floats, normals in bytes), and coefficients are of functions there.
// Paper   Lehtinen et al. 2007, sections 4 and 6.3.   Units  W m^-2 sr^-1: what a white surface sends out
// Repeat  same bits for any thread count

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/basis.h"
#include "core/meshless/light_links.h"
#include "core/meshless/points.h"

namespace kiln {

struct PointField {
  std::vector<RowSite> sites;            // level by level, coarse to fine
  std::vector<std::uint32_t> level_end;  // as in PointHierarchy
  std::vector<float> radius;             // r_j of each function, unit-cube lengths
  std::vector<Vec3f> coefficients;       // a_j
};

/// `light` of each point. Points that were asked for besides (demand.h) are left out: they are no Poisson set, and
/// where ten of them are far apart their functions would show as discs.
PointField make_point_field(const PointHierarchy&, std::span<const Vec3f> light, Threads&);

/// The basis of a field; its radii are those of the field.
MeshlessBasis basis_of(const PointField&, Threads&);

}  // namespace kiln
