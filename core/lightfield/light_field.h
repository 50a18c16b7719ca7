#pragma once
// Light that leaves a surface towards every eye, at the vertices of a mesh.
//   L~(p, w) = L(p, R_n w) = sum_i c_i Y_i(w),   R_n w = 2 (n.w) n - w                                            (1)
// L(p, w) is the radiance that leaves p in direction w, a radiance function (RF). What is stored is its reflection
// about the vertex' normal n, the r-RF: a highlight stands where its light is, so neighbours with other normals agree
// and may be interpolated.
// Paper   Vanhoey et al. 2015, 3.1 (after Wood et al. 2000).
// Shape   coefficients[(channels vertex + channel) count + i]; channels are red, green, blue
// Units   W m^-2 sr^-1; w is unit, in world axes, and points away from the surface.
// Below the horizon of n the series goes on with what it has at the horizon (section 7): the fit sees to it.
// A field of degree 0 may have other channels: any attribute whose distance is Euclid's, like transfer vectors. If it
// was drawn twice by chance, the first channels are the means of the draws and the last `noise` ones half of their
// differences.

#include <cstddef>
#include <span>
#include <vector>

#include "core/sphere/sh.h"

namespace kiln {

inline constexpr int kMaxLightFieldDegree = 8;

struct LightField {
  int degree = 4;                   // bands 0 .. degree, (degree + 1)^2 coefficients of each channel
  std::vector<float> coefficients;  // of one channel after the other, for each vertex
  std::size_t channels = 3;
  std::size_t noise = 0;

  std::size_t count() const { return static_cast<std::size_t>(sh_count(degree + 1)); }
  std::size_t row() const { return channels * count(); }
  std::size_t vertices() const { return coefficients.size() / row(); }
  std::span<const float> of(std::size_t vertex) const { return {coefficients.data() + row() * vertex, row()}; }
  std::span<float> of(std::size_t vertex) { return {coefficients.data() + row() * vertex, row()}; }
};

}  // namespace kiln
