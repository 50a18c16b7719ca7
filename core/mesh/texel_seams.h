#pragma once
// Light in texels, made whole: texels that show nothing are filled, and the two sides of a seam agree.
//
// Seam     an edge of the surface that lies in two places of the picture, with the same normals on both sides: light
//          does not change across it, bilinear filtering of different texels on its sides does.
// Stitched The texels x that filtering reads along seams move from their values x0 to where
//            sum over places of seams of (filtered here - filtered there)^2 + sum of hold (x - x0)^2               (1)
//          is least, by conjugate gradients. Texels in triangles hold kHoldInside, those beside one kHoldBorder: what
//          those show is an extrapolation.
// Error    before, a quarter of what the light changes over a texel; (1) leaves a fiftieth (measured by its test)
// Repeat   same bits always.   Fails   never

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/texel_map.h"

namespace kiln {

/// One place of the surface and its two coordinates.
struct SeamPlace {
  Vec2f here, there;
};

/// Two places a texel along all seams of the triangles that have a chart.
std::vector<SeamPlace> find_seams(const Mesh&, const UvCharts&, int side);

inline constexpr double kHoldInside = 0.1, kHoldBorder = 0.01;
void stitch_seams(std::span<const SeamPlace>, const TexelMap&, std::span<Vec3f> texels);

/// Texels without light (`known` 0) take the mean of their neighbours, ring by ring: first those that show a chart from
/// that chart alone (places inside solids), then the rest of the picture. All is black where nothing is known.
void fill_texels(const TexelMap&, const UvCharts&, std::vector<char> known, std::span<Vec3f> texels);

}  // namespace kiln
