#pragma once
// Textures of an atlas: what fell into texels becomes a normal map and a base colour map without holes.
//
// A texel's sum of normals is expressed in the frame that a viewer has there: interpolated unit normal and tangent, and
// the interpolated cross product of the two. Holes are filled chart by chart, from coarse to fine (a pyramid of
// weighted means), then smoothed by diffusion; the rim around a chart is filled the same way, so that nothing bleeds.
//
// Paper    [Pacanowski06] section 2, step 4; [Gortler96] pull-push
// Units    normal = 2 c / 255 - 1 of 8 bits, 2 c / 65535 - 1 of 16; colour sRGB, 8 bits; row 0 is the top
// Error    of normals .25 degrees with 8 bits, .002 with 16
// Repeat   same bits for any thread count

#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/reduce/charts.h"
#include "core/reduce/project.h"
#include "core/reduce/surface.h"

namespace kiln {

/// A vertex for each vertex of the surface and chart around it; normals are those of the triangles around within
/// 45 degrees of the chart's own, tangents run along the chart, w = 1. Without an atlas a vertex each, no uv0, no
/// tangent. Colours are those of the samples; none where `colors` is false. Triangles keep their order.
Mesh delivered_mesh(const Surface&, const Atlas*, bool colors);

struct SurfaceMaps {
  int side = 0;
  int normal_bits = 8;                      // or 16: then each value is two bytes, the higher first
  std::vector<std::uint8_t> normal, color;  // side * side * 3 values; no colour where the model has none
  double filled = 0;                        // share of the charts' texels that no point fell into
};
SurfaceMaps make_maps(const Mesh&, const Atlas&, const std::vector<Texel>&, bool colors, int normal_bits, Threads&);

/// RMS angle in degrees between the model's normals and what a viewer shows there: the interpolated vertex normal, bent
/// by the map (bilinear) where there is one.
double normal_error(const Mesh&, const SurfaceMaps*, const std::vector<NormalProbe>&);

}  // namespace kiln
