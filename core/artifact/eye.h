#pragma once
// What an eye sees of a baked scene: the diffuse light as ever, and on vertices that have matrices the specular one.
//   radiance = diffuse (1 - E) value + (F0 a + b) * reflected light + emission,   E = 0.04 a + b                    (1)
// where the light that arrives (glossy_transfer.h) is interpolated over the triangle and then reflected (lobe_table.h).
// E is what the specular layer keeps from the diffuse one below it, so that no surface sends back more than arrives.
// Where a triangle has no matrices everything is diffuse, with the full reflectance of the material.

#include <optional>
#include <span>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "core/prt/glossy_transfer.h"
#include "core/prt/lobe_table.h"

namespace kiln {

/// A material at a point, as core/trace/ggx.h splits it.
struct EyeMaterial {
  Vec3d base_color, diffuse, f0;
  double roughness = 1;
};

struct EyePoint {
  TrianglePoint place;
  Vec3d normal, view;  // unit; the view points to the eye
  EyeMaterial material;
};

/// Light over a baked scene, made once for many points.
struct EyeLight {
  std::vector<Vec3f> coefficients;  // of the transfer vectors' order, or empty
  std::vector<Vec3f> bright;        // of these (evaluate.h); what is reflected specularly knows no parts
  bool lamps = true;
  LitComponents lit;
};
EyeLight eye_light(const BakedScene&, std::vector<Vec3f> coefficients, bool lamps);
/// With the lamps, as a viewer shows it.
EyeLight eye_light(const BakedScene&, const LightParts&);

/// The two sums of equation 1, without emission. `specular` is 0 where there are no matrices.
struct EyeRadiance {
  Vec3d diffuse, specular;
};
EyeRadiance eye_radiance(const BakedScene&, const EyeLight&, const EyePoint&);

/// Whether all three corners have matrices.
bool has_matrices(const GlossyTransfer&, const Triangle&);

}  // namespace kiln
