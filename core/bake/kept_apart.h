#pragma once
// Whether a light field keeps the sky (core/lightfield/mirrored_sky.h) and punctual lamps (lamp_highlights.h) apart:
// only where something mirrors them more sharply than the series can say. Method  needed where a face of the scene is
// smooth enough (share_apart), and of the sky where the bands that the series
//         has leave more of its radiance out than storage may.

#include <optional>
#include <string>

#include "core/bake/recipe.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

struct ApartDecision {
  bool apart = false;
  std::string reason;
};

/// `share`: relRMSE that does not matter. `sky` may be null.
ApartDecision decide_sky(const Scene&, const Environment* sky, int degree, double share, SkyPart asked);

ApartDecision decide_lamps(const Scene&);

/// Emission is apart where a texture glows.
ApartDecision decide_emission(const Scene&);

/// Diffuse light is apart from base colour where textures colour or shape the diffuse layer.
ApartDecision decide_diffuse(const Scene&);

/// Surfaces that glow are never kept apart. Where a face is smooth enough to show them more sharply than bands 0 ..
/// degree can, a sentence that says so.
std::optional<std::string> softened_emitters(const Scene&, int degree);

/// Of the sky's radiance over all directions: what bands 0 .. degree leave, root mean square relative to the mean.
double left_by_bands(const Environment&, int degree);

}  // namespace kiln
