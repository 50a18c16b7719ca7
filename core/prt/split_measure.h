#pragma once
// How wrong linear interpolation over a triangle is: the priorities of adaptive subdivision.
// Paper   [Krivanek04] eqs. 2-4.   Differs  eq. 4 takes the mean of the three angles to the mean normal: the paper's
//         n_1 alone depends on vertex order.

#include <array>
#include <span>

#include "core/base/vec.h"
#include "core/prt/subdivide.h"

namespace kiln {

using Values = std::span<const float>;

/// Sum over the edges of |t1 - t2| / |t1 + t2| (eq. 2) or |t1 - t2| (eqs. 3 and 4, which divides by 1 + alpha angle).
float edge_measure(const Subdivide&, const std::array<Values, 3>& corner, const std::array<Vec3f, 3>& normal);

/// L2 norm over the triangle of (value - its linear interpolation), by the rule that is exact for cubics:
/// 1/20 for each corner (where the difference is 0), 2/15 for each edge midpoint, 9/20 for the centroid.
/// middle[k] lies between corners k and k + 1. Unit: that of a value times length.
float residual_measure(const std::array<Values, 3>& corner, const std::array<Values, 3>& middle, Values centroid,
                       double area);

}  // namespace kiln
