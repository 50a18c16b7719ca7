#pragma once
// The sky as smooth surfaces mirror it: what harmonics of few bands cannot hold.
//   sum = (F0 a + b) (sum_k w_k V(l_k) P(l_k, alpha_k)) / (sum_k w_k)                                              (1)
// P(r, alpha) is the sky blurred by the GGX lobe of an eye straight above (n = v = r), in maps of alpha 1, 2^-1/2, 1/2
// and so on. Towards other eyes the lobe is longer than wide: facets h_k of kFacets slopes along the plane of n and v
// mirror the eye to l_k, each with a lobe as wide as the whole one is across. V: how much of the sky the place sees
// that way. F0 a + b: core/prt/lobe_table.h.
// Paper   Karis 2013 (blurred maps, the split sum); Heitz 2018 (visible facets: w); McGuire et al. 2013, "Plausible
//         Blinn-Phong reflection of standard cube MIP-maps" (several look-ups along a lobe)
// Units   W m^-2 sr^-1; directions are unit, in world axes.   Error   README.md has a table
// Repeat  same bits for any thread count

#include <vector>

#include "core/base/threads.h"
#include "core/lightfield/light_field.h"
#include "core/scene/environment.h"

namespace kiln {

/// V, limited to [0, 1].
double visibility_along(const SkyVisibility&, const Vec3d& w);

/// P for alpha_i = 2^(-i / 2), equirectangular.
using SkyLevels = std::vector<Environment>;

/// Down to alpha `least`, in maps of at most 512 x 256 texels.
SkyLevels blur_sky(const Environment&, double least, Threads&);

/// Mean square of how a map changes over so many radians, per square radian, summed over R, G and B: over all
/// directions.
double mean_square_slope(const Environment& level, double over);

class MirroredSky {
 public:
  /// Expects at least two levels, and keeps a reference to them.
  explicit MirroredSky(const SkyLevels&);

  struct Surface {
    Vec3d normal, f0;
    double roughness = 1;
  };
  /// Equation 1. An eye below the horizon counts as at it.
  Vec3d seen(const Surface&, const SkyVisibility&, const Vec3d& view) const;

 private:
  Vec3d blurred(const Vec3d& w, double alpha) const;

  const SkyLevels& levels_;
};

}  // namespace kiln
