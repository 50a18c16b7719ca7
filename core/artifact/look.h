#pragma once
// How radiance becomes a picture: one exposure and one curve for COLOR_0, the preview and the viewer.
//
//   display(x) = x                                  for x <= 0.6        (true colours, linear)
//              = 1 - 0.4 exp(-(x - 0.6) / 0.4)      above               (a smooth shoulder that never reaches 1)   (1)
// of x = exposure * radiance, for each channel. The result is linear; sRGB encoding is the display's.

#include <span>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/base/vec.h"

namespace kiln {

inline constexpr const char* kToneMapName = "shoulder-0.6";

/// Equation 1; negative radiance (SH ringing) shows as black.
float tone_map(float x);
Vec3f tone_map(const Vec3f& exposed);

/// The exposure at which the brightest channel of the lit area's 90th percentile displays as 0.8; area that no light
/// reaches does not count. `radiance` has one value per vertex. 1 where nothing is lit.
float automatic_exposure(const Mesh&, std::span<const Vec3f> radiance);

/// The exposure at which `radiance` displays as 0.8; 1 where there is none.
float exposure_for(float radiance);

/// Linear exit radiance of each vertex under BakedLight:
///   albedo factor x vertex colour x value + emission factor
/// Textures are left out: a base colour texture multiplies in the viewer, textured emission does not count.
std::vector<Vec3f> baked_colors(const BakedScene&);

/// COLOR_0 of each vertex: the tone map of exposure x baked_colors.
std::vector<Vec3f> displayed_colors(const BakedScene&);

/// The part of each vertex; parts do not share vertices. Vertices without a triangle get part 0.
std::vector<std::uint32_t> part_of_vertices(const Mesh&);

/// What a part adds and multiplies: the numbers of the primitive-level extension.
struct PartLook {
  Vec3f albedo, emission;
};
PartLook part_look(const Scene&, const Part&);

}  // namespace kiln
