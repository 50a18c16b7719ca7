#pragma once
// What an eye sees of a light field between its vertices.
//   L(p, v) = sum_k alpha_k L~_k(R_n v),   n the interpolated normal                                              (1)
// Paper   Vanhoey et al. 2015, equation 8.   An eye below the horizon of n counts as at it (section 7); what the
// series leaves below 0 counts as 0.

#include "core/base/vec.h"
#include "core/lightfield/light_field.h"
#include "core/mesh/mesh.h"

namespace kiln {

/// u and v are the barycentrics of corners 1 and 2; normal and view are unit, the view points to the eye.
Vec3d seen_radiance(const LightField&, const Triangle&, double u, double v, const Vec3d& normal, const Vec3d& view);

}  // namespace kiln
