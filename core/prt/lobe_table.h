#pragma once
// What a rough surface reflects of the light around, band by band. Towards the eye in direction v, over a normal n,
// under light that arrives from the half space of n with coefficients L (glossy_transfer.h):
//   specular = (F0 a + b) (g_0 L_00 Y_00 + sum_{l > 0} sum_j g_lj sum_m L_lm Y_lm(axis_j))                        (1)
//   axis_j = n cos(72 j) + t sin(72 j) degrees, j = 0 .. 4,   t = the direction along the surface away from the eye
// F0 a + b is the integral of f(v, l) n.l dl. The sums are the mean over the lobe (l in proportion to f n.l without its
// Fresnel term) of the series that fits the light best above the surface:
//   mean = q . c,   q_i = mean of Y_i over the lobe,   (G + ridge) c = L,   G_ik = integral over the half space Y_i Y_k
// L alone, as a series, would be dark below the surface and have an edge there that few bands cannot hold; c is free
// below. What is even about the plane of view has l + 1 numbers in band l, which five axes in that plane span to
// band 4. Paper   Kautz, Sloan and Snyder 2002 (SH light reflected by any isotropic BRDF, tabled by view); Karis 2013
// (the
//         split sum: a, b).   Differs  the fit above the surface; no lobe symmetric about the mirror direction, which
//         misses by .3 at roughness .5.
// Shape   numbers[(row * kLobeViews + column) * width + k]; roughness = row / (kLobeRows - 1), angle of v and n =
//         pi/2 column / (kLobeViews - 1); k = 0, 1, 2 are a, b, g_0, and 3 + 5 (l - 1) + j is g_lj. Bilinear.
// Error   between rows and columns .01 of a and b (.03 within 6 degrees of grazing); exact under constant light over an
//         open point; else see the tests. The split sum neglects that Fresnel's rise favours grazing light.
// Cost    2 million drawn directions, once: .2 s

#include <array>
#include <vector>

#include "core/base/vec.h"
#include "core/sphere/sh.h"

namespace kiln {

inline constexpr int kLobeRows = 16, kLobeViews = 32;
inline constexpr int kLobeAxes = 5, kMaxLobeOrder = 5;

struct LobeTable {
  int order = 0;  // 1 .. kMaxLobeOrder
  std::vector<float> numbers;

  int width() const { return width_of(order); }
  static constexpr int width_of(int order) { return 3 + kLobeAxes * (order - 1); }
  static constexpr std::size_t size_of(int order) {
    return static_cast<std::size_t>(kLobeRows) * kLobeViews * static_cast<std::size_t>(width_of(order));
  }
};

LobeTable make_lobe_table(int order);
/// Of order 1: made when first asked for, and kept.
const LobeTable& albedo_table();

/// One entry, in between by interpolation. `nv` and roughness are limited to [0, 1].
struct Lobe {
  int order = 1;
  double a = 1, b = 0;
  double constant = 2;                                              // g_0
  std::array<std::array<double, kLobeAxes>, kMaxLobeOrder> gain{};  // g_lj

  /// Directional albedo for reflectance F0 at normal incidence.
  Vec3d albedo(const Vec3d& f0) const { return f0 * a + Vec3d{b, b, b}; }
  /// That of F0 = .04: what the specular layer keeps from the diffuse one below it.
  double kept() const { return 0.04 * a + b; }
};
Lobe lobe_at(const LobeTable&, double nv, double roughness);

/// Equation 1 without F0 a + b as weights of the light's coefficients, order^2 of them.
using LobeKernel = std::array<double, sh_count(kMaxLobeOrder)>;
LobeKernel lobe_kernel(const Lobe&, const Vec3d& normal, const Vec3d& view);

/// Equation 1 without F0 a + b, RGB. `view` is unit and points to the eye; from below the surface it counts as grazing.
/// `light` has order^2 coefficients. Negative light (ringing) counts as 0.
Vec3d reflected_light(const Lobe&, const Vec3d& normal, const Vec3d& view, const Vec3d* light);

}  // namespace kiln
