#pragma once
// The charts of a mesh by its second set of texture coordinates, and their place in one square picture.
//
// Chart    triangles that share vertices, vertices of one position, normal and coordinate being one. What shares a
//          coordinate and not a normal is parted: light differs across a hard edge.
// Kept     A layout of the author's is kept where it is one: inside [0, 1] and no chart on another.
// Packed   Else (each mesh has a layout of its own, instances share theirs, coordinates tile) every chart gets a
//          rectangle on shelves, ordered by height, at one density of texels on the surface. Its sides are whole
//          texels, so that the border of a rectangle lies on texel centres and needs nothing from outside.
// Units    coordinates in parts of the picture, v downwards; density in texels per unit-cube length
// Repeat   same bits always.   Fails   never; what does not fit says so

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

inline constexpr std::uint32_t kNoChart = 0xffffffffU;

struct UvCharts {
  std::vector<std::uint32_t> of;  // chart of each triangle; kNoChart: it is not shown
  std::uint32_t count = 0;
};

/// `shown` has a flag for each triangle. mesh.uv1 is there.
UvCharts find_uv_charts(const Mesh&, std::span<const char> shown);

/// Texels between two charts: each is read one texel beyond its border.
inline constexpr int kChartGap = 2;

/// uv1 of a mesh whose charts lie beside each other in a picture of `side` texels, at the highest density that fits;
/// vertices that are not shown keep theirs. Nothing where not even a texel for each fits.
std::optional<std::vector<Vec2f>> pack_uv_charts(const Mesh&, const UvCharts&, int side);

}  // namespace kiln
