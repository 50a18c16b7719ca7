#pragma once
// What a rough surface reflects of the light around, band by band. Towards the eye in direction v, over a normal n,
// under light that arrives from the half space of n with coefficients L (glossy_transfer.h), continued below it by its
// mirror image:
//   specular = (F0 a + b) (2 L_00 Y_00 + sum_{l > 0} sum_j g_lj sum_m L_lm (Y_lm(axis_j) + Y_lm(image_j)))        (1)
//   axis_0 = n,  axis_1 = (n + t) / sqrt(2),  axis_2 = t,  t = the direction along the surface away from the eye
//   image_j = axis_j mirrored about the surface: -n, (t - n) / sqrt(2), t
// F0 a + b is the integral of f(v, l) n.l dl. The g_lj make (1) the mean of the light over the lobe, l in proportion to
// f n.l without its Fresnel term: what is even about surface and plane of view has l / 2 + 1 numbers in band l, which
// symmetric functions about three axes span up to band 4. A mirror is such a lobe too.
// Paper   Kautz, Sloan and Snyder 2002 (SH light reflected by any isotropic BRDF, tabled by view); Karis 2013 (the
//         split sum: a, b).   Differs  their lobes symmetric about the mirror direction miss by .3 at roughness .5.
// Shape   numbers[(row * kLobeViews + column) * width + k]; roughness = row / (kLobeRows - 1), angle of v and n =
//         pi/2 column / (kLobeViews - 1); k = 0, 1 are a, b, and 2 + 3 (l - 1) + j is g_lj. Bilinear.
// Error   between rows and columns .01 of a and b (.03 within 6 degrees of grazing), .005 of the mean of light that
//         spreads by half of itself (measured by the tests); and what the split sum neglects
// Cost    2 million drawn directions, once: .2 s

#include <array>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

inline constexpr int kLobeRows = 16, kLobeViews = 32;
inline constexpr int kMaxLobeOrder = 5;

struct LobeTable {
  int order = 0;  // 1 .. kMaxLobeOrder
  std::vector<float> numbers;

  int width() const { return width_of(order); }
  static constexpr int width_of(int order) { return 2 + 3 * (order - 1); }
  static constexpr std::size_t size_of(int order) {
    return static_cast<std::size_t>(kLobeRows) * kLobeViews * static_cast<std::size_t>(width_of(order));
  }
};

LobeTable make_lobe_table(int order);

/// One entry, in between by interpolation. `nv` and roughness are limited to [0, 1].
struct Lobe {
  int order = 1;
  double a = 1, b = 0;
  std::array<std::array<double, 3>, kMaxLobeOrder> gain{};  // g_lj

  /// Directional albedo for reflectance F0 at normal incidence.
  Vec3d albedo(const Vec3d& f0) const { return f0 * a + Vec3d{b, b, b}; }
};
Lobe lobe_at(const LobeTable&, double nv, double roughness);

/// Equation 1 without F0 a + b, RGB. `view` is unit and points to the eye; from below the surface it counts as grazing.
/// `light` has order^2 coefficients. Negative light (ringing) counts as 0.
Vec3d reflected_light(const Lobe&, const Vec3d& normal, const Vec3d& view, const Vec3d* light);

}  // namespace kiln
