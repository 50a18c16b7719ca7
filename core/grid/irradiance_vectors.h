#pragma once
// Light at a point for receivers of any direction, as six irradiance vectors and what blends make of them.
//   I_d = integral over the hemisphere of d of L(w) w dw,  d = +x -x +y -y +z -z;  E(d) = I_d . d                  (1)
// Paper    Pacanowski et al. 2006, sections 3-2 to 3-4; formulas as mended in the shared notes.
// Blends   exact: with Phi = I+ + I-, D_i = I+_i - I-_i, A_i = D_i . e_i, B_ij = D_i . e_j + D_j . e_i
//            E(n) = 1/2 Phi . n + 1/2 sum_i n_i^2 A_i + 1/4 sum_{i<j} n_i n_j B_ij                                 (2)
//          reproduces light of SH bands 0 to 2 exactly and costs nine numbers a channel;
//          paper: I_n = sum over the three directions on n's side of n_i^2 I_i, E(n) = I_n . n                     (3)
//          returns sum |n_i|^3 of constant light: .577 along a diagonal. Kept as the paper has it.
// Texels   the paper's compression of (3), one colour (|I_R|, |I_G|, |I_B|) and one unit direction (of the sum) for
//          each d:  E(n) = sum n_i^2 colour_i max(0, direction_i . n)                                              (4)
// Units    E in W m^-2 for L in W m^-2 sr^-1; the value of other steps is E / pi

#include <array>
#include <cstddef>

#include "core/base/vec.h"

namespace kiln {

inline constexpr std::size_t kDirections = 6;

/// RGB, each a vector: vector[direction][channel].
struct IrradianceVectors {
  std::array<std::array<Vec3f, 3>, kDirections> vector{};

  IrradianceVectors& operator+=(const IrradianceVectors& other) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      for (std::size_t c = 0; c < 3; ++c) vector[d][c] += other.vector[d][c];
    }
    return *this;
  }
};

/// Sums rays: L(w) dw is added to the octant of w, from which all six hemispheres are made.
class OctantSums {
 public:
  /// `light` is L(w), up to the scale that vectors() takes: in the end each ray stands for light x scale.
  void add(const Vec3f& w, const Vec3f& light) {
    const int octant = (w.x < 0 ? 1 : 0) | (w.y < 0 ? 2 : 0) | (w.z < 0 ? 4 : 0);
    auto& sum = sums_[static_cast<std::size_t>(octant)];
    sum[0] += w * light.x, sum[1] += w * light.y, sum[2] += w * light.z;
  }
  IrradianceVectors vectors(float scale) const;

 private:
  std::array<std::array<Vec3f, 3>, 8> sums_{};
};

/// Equation 2: phi.x phi.y phi.z a.x a.y a.z b.xy b.xz b.yz, each RGB.
inline constexpr std::size_t kExactParts = 9;
std::array<Vec3f, kExactParts> exact_parts(const IrradianceVectors&);
/// The factors of the nine parts in equation 2.
std::array<float, kExactParts> exact_weights(const Vec3f& n);

/// Equation 4: px.color px.direction nx.color ... nz.direction.
inline constexpr std::size_t kPaperParts = 12;
std::array<Vec3f, kPaperParts> paper_parts(const IrradianceVectors&);

/// Which of the six directions lies on n's side of an axis: 2 axis, or 2 axis + 1 where n points against it.
inline std::size_t direction_on(std::size_t axis, const Vec3f& n) { return 2 * axis + (n[axis] < 0 ? 1 : 0); }

/// Equations 2, 3 and 4, at least 0. `n` is unit.
Vec3f exact_irradiance(const std::array<Vec3f, kExactParts>&, const Vec3f& n);
Vec3f paper_irradiance(const IrradianceVectors&, const Vec3f& n);
Vec3f texel_irradiance(const std::array<Vec3f, kPaperParts>&, const Vec3f& n);

}  // namespace kiln
