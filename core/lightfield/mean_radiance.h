#pragma once
// What a light field looks like from nowhere in particular: its mean over all eyes above a vertex.
//   mean = 1/(2 pi) integral over n.w > 0 of L(w) dw = sum_i c_i lambda_l Y_i(n),   lambda_l = integral_0^1 P_l(t) dt
// by Funk and Hecke; an r-RF has the mean of its RF, because reflection keeps the half space.
// Units   of the coefficients.   Error  rounding.   Repeat  same bits always.   Fails  never

#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/lightfield/light_field.h"

namespace kiln {

/// Of each vertex; `normal` is that of the mesh. What the series leaves below 0 counts as 0.
std::vector<Vec3f> mean_radiance(const LightField&, std::span<const Vec3f> normal);

}  // namespace kiln
