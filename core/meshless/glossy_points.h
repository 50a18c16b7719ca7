#pragma once
// Transfer matrices computed at few points and read at the vertices.
//   M(v) = O(n_v) + sum over points p that v sees of B_p(v) (M(p) - O(n_p)),   O(n) = that of an open point of normal n
// O is known in closed form, and it is what turns with the normal: points hold what other surfaces hide and send.
// B_p are Shepard weights, made linear in place and normal (linear_weights.h).
// Paper   Lehtinen et al. 2007, section 6.4: refined where the matrix of a point and what coarser points predict there
//         differ by more than eps_T in the 1-norm (adaptive_points.h, GlossyComponents::norm1).
// Differs the paper's matrices hold all light, its functions are differences between levels, and they know no sight.
// Noise   of the rays refines nothing: eps_T^2 and the squared norm of the noise are added.
// Memory  points hold weights of components (core/prt/glossy_components.h), which come from the matrices of the
// coarsest
//         kGlossySamples points; of O the weights are polynomials of the normal.
// Vertices that see no point have matrices of their own.
// Repeat  same bits for any thread count.      Fails  never on a valid scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/points.h"
#include "core/prt/glossy_bake.h"

namespace kiln {

struct GlossyPoints {
  GlossyBake bake;        // its progress counts matrices of those that there may be
  PointPlacement points;  // on the parts that are to have matrices
  int uniform_levels = 3;
  int neighbours = 10;                                     // of the points around a vertex
  float eps = 0.1F;                                        // eps_T, of the mean light that arrives
  std::function<void(std::string_view stage)> stage = {};  // told as each begins: points, rays, basis
};

struct GlossyPointStats {
  std::vector<std::uint32_t> points, computed;  // on each level
  std::size_t alone = 0;                        // vertices with matrices of their own
  float noise = 0;                              // of a matrix, in the 1-norm
  std::size_t matrices() const;                 // of points and lone vertices
};

/// As bake_glossy; `noise` of the result is that of what a vertex reads.
GlossyBaked bake_glossy_on_points(const Tracer&, const Transfer& light, std::span<const std::uint32_t> vertices,
                                  const GlossyPoints&, Threads&, GlossyPointStats&);

}  // namespace kiln
