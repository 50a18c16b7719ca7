#pragma once
// The leaf tree: a mesh in pieces that lie flat, and a square atlas that holds a rectangle for each.
//
// A box of triangles is split at the median of its longest side until, seen along the mean normal of its triangles,
// none is steeper than kSteepest and no two overlap. What is left is projected onto its plane and turned so that its
// rectangle is small; neighbours that lie flat together are joined again; rectangles are put on shelves by height, at
// the largest scale that fits.
//
// Paper    [Pacanowski06] section 2, step 3: leaves with quadrilateral textures, split until nothing folds over
// Units    charts in texels; v runs downwards, so that across(normal, tangent) points up in the image
// Cost     O(n log n)
// Repeat   same bits always

#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/mesh/mesh.h"

namespace kiln {

/// A piece of the mesh and its rectangle: texel = origin + texels per length * (tangent p - low.x, high.y - up p).
struct Chart {
  std::vector<std::uint32_t> triangles;
  Vec3d normal, tangent, up;
  Vec2<double> low, high;                   // of tangent p and up p
  int x = 0, y = 0, width = 0, height = 0;  // in the atlas, padding included

  Vec2<double> texel(const Vec3d& p, double density, int padding) const {
    return {x + padding + (dot(tangent, p) - low.x) * density, y + padding + (high.y - dot(up, p)) * density};
  }
};

struct Atlas {
  int side = 0, padding = 0;
  double density = 0;  // texels per unit length
  std::vector<Chart> charts;
  std::vector<std::uint32_t> chart_of;  // of each triangle
};

/// Cosine of the steepest triangle against its chart: 44 degrees, so that no chart bends around a right angle, and
/// lengths in the texture are no less than this share of those on the surface.
inline constexpr double kSteepest = 0.72;

/// Charts, not yet placed.
Atlas make_charts(const std::vector<Vec3d>& position, const std::vector<Triangle>&);

/// Places the charts of an atlas in a square of this many texels. False where not even empty ones fit.
bool place_charts(Atlas&, int side);

}  // namespace kiln
