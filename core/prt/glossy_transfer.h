#pragma once
// Transfer matrices at the vertices that need them: from lighting to the light that arrives there.
//   L[c][o](v) = sum_i M[c][o][i](v) light_i[c]  (+ M[c][o][order^2] where `fixed`: light of the scene's own lamps) (1)
//   M(v) = mean + sum_k w_k(v) row_k                                                                              (2)
// L are SH coefficients, in world axes, of the radiance that arrives at v from the half space of its normal: from the
// sky where it is seen, and from the diffuse surfaces that hide it. Nothing arrives from below. (The sky's part is a
// product with visibility: all matrices of a scene lie in (2 order - 1)^2 dimensions, and few components hold them.
// Matrices of light that is continued below the surface, as it is reflected in lobe_table.h, hang on the normal in a
// way that hundreds do not catch.)
// Paper   Kautz, Sloan and Snyder 2002; Lehtinen et al. 2007, section 6.4 (25 terms)
// Shape   row[(c * order^2 + o) * inputs() + i]; weights[n * rank + k] of the n-th of `vertices`
// Units   as Transfer: light and L are radiance.

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/prt/components.h"
#include "core/sphere/sh.h"

namespace kiln {

struct GlossyTransfer {
  int order = 0;       // bands of the light and of L; 0: there are no matrices
  int channels = 1;    // 1: the same for red, green and blue
  bool fixed = false;  // a last column with what the lamps bring, seen directly or by diffuse reflection
  Components components;
  std::vector<std::uint32_t> vertices;  // of the mesh, ascending
  std::vector<float> weights;

  explicit operator bool() const { return order > 0; }
  int outputs() const { return sh_count(order); }
  int inputs() const { return sh_count(order) + (fixed ? 1 : 0); }
  std::size_t stride() const {
    return static_cast<std::size_t>(channels) * static_cast<std::size_t>(outputs()) *
           static_cast<std::size_t>(inputs());
  }
  std::size_t rank() const { return components.rank(); }
  /// The place of a mesh vertex among `vertices`, or kNoMatrix.
  static constexpr std::size_t kNoMatrix = ~std::size_t{0};
  std::size_t find(std::uint32_t vertex) const;
};

/// Equation 1 of the mean and of each row: what is then left for a vertex is a sum over its weights.
/// Shape   rgb[k * outputs + o], k = 0 the mean
struct LitComponents {
  int outputs = 0;
  std::vector<Vec3f> rgb;
};

/// `light` is empty (darkness) or has at least outputs() coefficients, of which the first count; `lamps`: add theirs.
LitComponents light_components(const GlossyTransfer&, std::span<const Vec3f> light, bool lamps);

/// L of the n-th matrix vertex: outputs() RGB coefficients, written to `out`.
void incident_light(const GlossyTransfer&, const LitComponents&, std::size_t n, Vec3d* out);

}  // namespace kiln
