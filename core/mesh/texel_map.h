#pragma once
// Which place of a surface each texel of a square picture shows, by the second set of texture coordinates.
//   texel (i, j), number j side + i, has its centre at ((i + 1/2) / side, (j + 1/2) / side); v runs downwards
// Inside   a texel whose centre lies in a triangle shows that place.
// Border   one whose centre lies beside a triangle, but so near that bilinear filtering of the triangle reads it, shows
//          the nearest place of the triangle (in the picture).
// Overlap  a centre well inside of two triangles shows the first, and is counted.
// Cost     texels of the triangles' boxes.   Memory   21 bytes a texel of the picture while it works
// Repeat   same bits always.   Fails   never; a triangle without area in the picture is the line or dot that it is

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/uv_charts.h"

namespace kiln {

struct TexelPlace {
  std::uint32_t texel = 0, triangle = 0;
  float u = 0, v = 0;  // barycentrics of corners 1 and 2
  bool inside = false;
};

struct TexelMap {
  int side = 0;
  std::vector<TexelPlace> places;                    // texels ascend
  std::uint64_t inside = 0, within = 0, across = 0;  // texels in triangles; in two of one chart; in two charts
};

/// Triangles without a chart are not shown. Coordinates beyond the picture are cut off.
TexelMap map_texels(const Mesh&, const UvCharts&, int side);

/// Which triangles reach into some texels, of the chart that each of these shows.
class TexelParts {
 public:
  /// `wanted`: of map.places, ascending. Keeps references to mesh and map.
  TexelParts(const Mesh&, const UvCharts&, const TexelMap&, std::span<const std::uint32_t> wanted);

  /// Places in the middle of the side x side parts of texel wanted[k], of those parts whose middle lies in a triangle.
  std::vector<TexelPlace> of(std::size_t k, int side) const;

 private:
  const Mesh& mesh_;
  const TexelMap& map_;
  std::vector<std::uint32_t> texel_;
  std::vector<std::vector<std::uint32_t>> triangles_;  // of each
};

/// The four texels that bilinear filtering reads at uv, and their weights; the border texels are repeated outwards.
struct Bilinear {
  std::array<std::uint32_t, 4> texel{};
  std::array<float, 4> weight{};
};
Bilinear bilinear_at(const Vec2f& uv, int side);

}  // namespace kiln
