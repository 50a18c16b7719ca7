#pragma once
// The specular part of glTF's metallic-roughness material: a GGX microfacet lobe, and how to draw from it.
//   f(v, l) = F D(n.h) V(n.v, n.l),   alpha = roughness^2,   F = F0 + (1 - F0) (1 - v.h)^5                       (1)
// Paper   glTF 2.0 appendix B (distribution of Trowbridge and Reitz, height-correlated Smith masking, Schlick's
//         Fresnel); drawing of visible normals: Heitz 2018, "Sampling the GGX Distribution of Visible Normals".
// Units   f in sr^-1. Directions are unit, in the frame of the normal: +z is the normal, v towards the eye, l towards
//         the light.   Differs  alpha is at least kLeastAlpha: a perfect mirror is a very sharp lobe.
// Single scattering only, as in glTF: rough metals lose up to .6 of what they should reflect at roughness 1.

#include "core/base/vec.h"

namespace kiln {

inline constexpr double kLeastAlpha = 1e-3;  // roughness 0.032
inline constexpr double kDielectricF0 = 0.04;

/// Of a material's roughness, limited to [kLeastAlpha, 1].
double ggx_alpha(double roughness);

/// F0 of equation 1, and what is left for diffuse reflection: mix(0.04, colour, metallic) and (1 - metallic) colour.
Vec3d specular_f0(const Vec3d& base_color, double metallic);
Vec3d diffuse_color(const Vec3d& base_color, double metallic);

/// Equation 1 without F, times n.l. 0 where either direction is not above the surface.
double ggx_cosine(double alpha, const Vec3d& v, const Vec3d& l);

/// (1 - v.h)^5: the weight of 1 - F0 in F.
double schlick_weight(const Vec3d& v, const Vec3d& l);

/// A direction l drawn in proportion to the visible normals that mirror v there; may lie below the surface, where
/// `weight` is 0. `u` is uniform in [0, 1)^2; v.z > 0.
struct GgxSample {
  Vec3d l;
  double weight = 0;  // ggx_cosine / density
};
GgxSample sample_ggx(double alpha, const Vec3d& v, const Vec2<double>& u);
/// Density of sample_ggx per solid angle; 0 for l below the surface.
double ggx_density(double alpha, const Vec3d& v, const Vec3d& l);

}  // namespace kiln
