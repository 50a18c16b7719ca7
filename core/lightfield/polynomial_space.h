#pragma once
// The best polynomials for a light field: each r-RF becomes the nearest one, on the hemisphere of its normal, that is a
// hemispherical polynomial of the same degree (core/sphere/hemispherical_polynomials.h). Those are the harmonics even
// in z of the local frame, which are orthogonal on the half space with squared norm 1/2:
//   c_e' = c_e + 2 sum_o c_o integral over z > 0 of Y_e Y_o dw,   c_o' = 0                                         (1)
// So (degree + 1)(degree + 2) / 2 numbers tell all of it instead of (degree + 1)^2. It stays in harmonics of world
// axes, where two of them can be mixed; a mix of neighbours with other normals is no polynomial any more. The best
// polynomial is that of the best series, because its space is a part of the series'. Paper   the basis of Vanhoey et
// al. 2015, section 6.   Error  1e-6 of the coefficients (floats) Cost    two rotations a vertex and channel.   Repeat
// same bits for any thread count.   Fails  Cancelled if stopped

#include <span>

#include "core/base/threads.h"
#include "core/base/vec.h"
#include "core/lightfield/light_field.h"

namespace kiln {

/// `normal` of each vertex.
void keep_polynomials(LightField&, std::span<const Vec3f> normal, Threads&);

}  // namespace kiln
