#pragma once
// Distant light. One type for a constant sky, a formula and an equirectangular map.

#include <functional>
#include <string>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

/// Equirectangular radiance, top row first, bilinear with wrap in u; 1 x 1 is a constant sky.
///   u = 0.5 + atan2(z, x) / (2 pi),  v from the top = 0.5 - asin(y) / pi      (glTF axes)
/// Lookups turn it by `rotation_deg` about +Y (positive turns +Z towards +X, that is the map moves
/// counter-clockwise seen from above) and multiply by `intensity`.
struct Environment {
  std::string name;
  int width = 1, height = 1;
  std::vector<Vec3f> radiance{{0, 0, 0}};
  float rotation_deg = 0;
  float intensity = 1;
};

/// Radiance that arrives from the unit direction `w` (pointing away from the scene).
Vec3f environment_radiance(const Environment&, const Vec3f& w);

/// A map of 2 height x height texels, each the mean of `radiance` over its directions (parts x parts of them).
Environment averaged_sky(int height, int parts, const std::function<Vec3f(const Vec3f& w)>& radiance);

/// Environment SH coefficients, RGB for each i = l(l+1)+m, integrated texel by texel over exact solid angles
/// (the bilinear function itself is integrated, so that a projection and a lookup agree).  `order` 1..10.
std::vector<Vec3f> project_environment(const Environment&, int order);

/// Built-in skies. `constant_sky` is 1 x 1; the others are 256 x 128 maps from formulas.
Environment constant_sky(const Vec3f& radiance);
Environment overcast_sky();        // CIE overcast, zenith radiance 1; the ground reflects 0.2 of the horizon
Environment clear_sky_with_sun();  // CIE clear sky, sun at 45 degrees elevation, 0.53 degrees wide

}  // namespace kiln
