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
// Where a vertex mirrors the sky more sharply than the series can, the sky's part may be kept apart: then there is
// `visibility` too, and L~ is the series and what mirrored_sky.h adds. Punctual lamps are kept apart in the same way:
// then `lamps` and `lamp_visibility` are there, and lamp_highlights.h adds what surfaces mirror of them. Where textures
// glow, emission is theirs (`emission_apart`), as sharp as they are: whoever shows the field adds it. Where textures
// have colours, base colour is theirs too: then `diffuse` is there, the light that a white vertex would send, and
// seen.h multiplies it by the colour of the place. A field of degree 0 may have other channels: any attribute whose
// distance is Euclid's, like transfer vectors. If it was drawn twice by chance, the first channels are the means of the
// draws and the last `noise` ones half of their differences.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"
#include "core/sphere/sh.h"

namespace kiln {

inline constexpr int kMaxLightFieldDegree = 8;

/// How much of the sky a place sees in a direction, limited to [0, 1]: harmonics in world axes.
inline constexpr int kVisibilityOrder = 3;
inline constexpr std::size_t kVisibilityCount = sh_count(kVisibilityOrder);
using SkyVisibility = std::array<float, kVisibilityCount>;

/// A punctual lamp that is kept apart (field_lamp.h makes it).
struct FieldLamp {
  Light light;                                 // lengths of the unit cube
  Vec3f mean;                                  // F0 times its irradiance, root mean square: for distances only,
  std::array<float, kVisibilityCount> lobe{};  // as is what of a highlight distances see, for a mean of 1
};

/// So many are kept apart at most.
inline constexpr std::size_t kMostFieldLamps = 8;

struct LightField {
  int degree = 4;                   // bands 0 .. degree, (degree + 1)^2 coefficients of each channel
  std::vector<float> coefficients;  // of one channel after the other, for each vertex
  std::vector<float> visibility;    // of the sky: kVisibilityCount harmonics for each vertex, or empty
  Vec3f sky;                        // what a visibility of 1 adds, in the mean: for distances only,
  float sky_slope = 0;              // and the mean square of how that changes with the normal, RGB, per square radian
  std::vector<FieldLamp> lamps;     // that are kept apart
  std::vector<float> lamp_visibility;  // of each of them at each vertex, 0 to 1
  bool emission_apart = false;         // what the surface's own material emits is not in the series
  std::vector<float> diffuse;          // light of the diffuse layer at each vertex, RGB, at colour 1; or empty
  Vec3f diffuse_color;                 // what such light of 1 adds, root mean square: for distances only
  std::size_t channels = 3;
  std::size_t noise = 0;

  std::size_t count() const { return static_cast<std::size_t>(sh_count(degree + 1)); }
  std::size_t row() const { return channels * count(); }
  std::size_t vertices() const { return coefficients.size() / row(); }
  std::span<const float> of(std::size_t vertex) const { return {coefficients.data() + row() * vertex, row()}; }
  bool has_sky() const { return !visibility.empty(); }
  bool has_lamps() const { return !lamps.empty(); }
  bool has_diffuse() const { return !diffuse.empty(); }
  std::span<float> of(std::size_t vertex) { return {coefficients.data() + row() * vertex, row()}; }
};

/// A field of no vertices whose rows are those of another.
LightField empty_like(const LightField&);

/// The series of a vertex as distances see it: with the sky's part, as if the sky were even, blurred highlights, and
/// diffuse light on one colour for all.
std::vector<double> mean_light(const LightField&, std::size_t vertex);

/// Calls visit(array, numbers of a vertex) for each array of a field that has something.
template <class Field, class Visit>
void each_field_array(Field& field, const Visit& visit) {
  visit(field.coefficients, field.row());
  if (field.has_sky()) visit(field.visibility, kVisibilityCount);
  if (field.has_lamps()) visit(field.lamp_visibility, field.lamps.size());
  if (field.has_diffuse()) visit(field.diffuse, 3);
}

/// Calls visit(array of a, array of b, numbers of a vertex) for each array that `b` has.
template <class FieldA, class FieldB, class Visit>
void each_field_array_of(FieldA& a, FieldB& b, const Visit& visit) {
  visit(a.coefficients, b.coefficients, b.row());
  if (b.has_sky()) visit(a.visibility, b.visibility, kVisibilityCount);
  if (b.has_lamps()) visit(a.lamp_visibility, b.lamp_visibility, b.lamps.size());
  if (b.has_diffuse()) visit(a.diffuse, b.diffuse, 3);
}

}  // namespace kiln
