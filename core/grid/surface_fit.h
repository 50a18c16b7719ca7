#pragma once
// Vertices of a grid moved by as little as makes surfaces read right: what stands at a vertex is right there, but a
// surface reads between vertices and beyond the last of them.
//   minimise  sum over places s of (sum over corners v of w_sv dE_v(n_s) - r_s)^2 + kTrust sum over v of |y_v|^2   (1)
//   dE_v(n) = sum over i of y_vi f_i(n),  r_s = light of the place - what the grid reads there
// f_i are the nine functions of bands 0, 1 and 2, orthonormal over the sphere up to a factor of each band: what changes
// along n_s changes little elsewhere. Vertices that no place reads stay as they are, and so does the paper's blend,
// which is not linear.
// Paper   Paige and Saunders 1982, section 7.1 (CGLS), kSteps steps.   Differs  Pacanowski et al. gather at vertices
//         alone
// Cost    kSteps x 8 x 18 multiplications a place and channel; 84 bytes a place and 324 a vertex
// Error   README.md   Repeat  same bits for any thread count

#include <vector>

#include "core/base/threads.h"
#include "core/grid/surface_gather.h"

namespace kiln {

inline constexpr float kTrust = 0.3F;
inline constexpr double kBand1 = 0.7, kBand2 = 0.5;  // the factors of bands 1 and 2

/// `grid` is of the exact blend, and places lie in its lattice's lengths.
void fit_to_surface(const std::vector<SurfacePlace>&, Grid&, Threads&);

}  // namespace kiln
