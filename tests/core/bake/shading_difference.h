#pragma once
// How different a surface looks under two grids: CIELAB delta E (CIE 1976, D65) of its shading.
//   shading = exposure x albedo x E / pi, clipped at 1; exposure makes a white surface .5 on average under the first
//   grid

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/grid/grid.h"
#include "core/prt/hidden.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln::testing {

/// L, a, b of linear sRGB (IEC 61966-2-1 primaries, CIE 15:2004 section 8.2.1).
inline Vec3d cielab(const Vec3d& rgb) {
  const auto f = [](double t) {
    constexpr double kDelta = 6.0 / 29;
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
  };
  const double x = f((0.4124 * rgb.x + 0.3576 * rgb.y + 0.1805 * rgb.z) / 0.9505);
  const double y = f(0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z);
  const double z = f((0.0193 * rgb.x + 0.1192 * rgb.y + 0.9505 * rgb.z) / 1.0890);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

struct ShadingDifference {
  double mean = 0, p99 = 0;  // delta E
};

/// At random places of the surface that can be seen; grids in world lengths.
inline ShadingDifference shading_difference(const Tracer& tracer, const Grid& first, const Grid& other) {
  const Scene& scene = tracer.scene();
  const HiddenTest hidden = hidden_test(tracer);
  struct Shaded {
    Vec3d albedo, first, other;
  };
  std::vector<Shaded> places;
  double mean = 0;
  for (const SurfaceSample& s : sample_surface(scene.mesh, 4000, 11)) {
    const SurfacePoint p = surface_point(scene, s.triangle, s.u, s.v);
    if (hidden({p.position, p.normal, p.position, p.geometric_normal})) continue;
    const Vec3d at = scene.frame.to_world(to_double(p.position));
    const auto light = [&](const Grid& grid) {
      return to_double(irradiance_at(grid, at, p.normal)) / std::numbers::pi;
    };
    places.push_back({to_double(albedo_at(scene, p)), light(first), light(other)});
    mean += (places.back().first.x + places.back().first.y + places.back().first.z) / 3;
  }
  const double exposure = mean > 0 ? 0.5 * static_cast<double>(places.size()) / mean : 1;
  std::vector<double> apart;
  for (const Shaded& p : places) {
    const auto shade = [&](const Vec3d& light) {
      const Vec3d x = p.albedo * light * exposure;
      return cielab({std::min(1.0, x.x), std::min(1.0, x.y), std::min(1.0, x.z)});
    };
    apart.push_back(length(shade(p.first) - shade(p.other)));
  }
  std::sort(apart.begin(), apart.end());
  ShadingDifference out;
  for (const double d : apart) out.mean += d / static_cast<double>(apart.size());
  if (!apart.empty()) out.p99 = apart[apart.size() * 99 / 100];
  return out;
}

}  // namespace kiln::testing
