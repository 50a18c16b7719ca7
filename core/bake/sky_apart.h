#pragma once
// Whether a light field keeps the sky apart (core/lightfield/mirrored_sky.h): only where something mirrors it more
// sharply than the series can say.
// Method  needed where a face of the scene is smooth enough (share_apart), and the bands that the series has leave more
//         of the sky's radiance out than storage may.

#include <string>

#include "core/bake/recipe.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

struct SkyDecision {
  bool apart = false;
  std::string reason;
};

/// `share`: relRMSE that does not matter. `sky` may be null.
SkyDecision decide_sky(const Scene&, const Environment* sky, int degree, double share, SkyPart asked);

/// Of the sky's radiance over all directions: what bands 0 .. degree leave, root mean square relative to the mean.
double left_by_bands(const Environment&, int degree);

}  // namespace kiln
