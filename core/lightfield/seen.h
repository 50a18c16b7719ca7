#pragma once
// What an eye sees of a light field between its vertices.
//   L(p, v) = sum_k alpha_k L~_k(R_n v) + what is kept apart (mirrored_sky.h, lamp_highlights.h, diffuse)          (1)
//   diffuse = (1 - metallic) base colour x (1 - E(n.v)) sum_k alpha_k diffuse_k                                     (2)
// n is the interpolated normal; E is what the specular layer keeps (core/prt/lobe_table.h).
// Paper   Vanhoey et al. 2015, equation 8, who keep nothing apart.   An eye below the horizon of n counts as
// at it (section 7); what the series leaves below 0 counts as 0. Where the sky is apart the series says how a place
// differs from it, which rings below 0 in folds: there nothing is less than kLeastSeen of the series' own mean over all
// directions and of (2), so that folds are dim and not black. (Errors stay what they were: README.md.)

#include "core/base/vec.h"
#include "core/lightfield/lamp_highlights.h"
#include "core/lightfield/light_field.h"
#include "core/lightfield/mirrored_sky.h"
#include "core/mesh/mesh.h"

namespace kiln {

inline constexpr double kLeastSeen = 0.25;

struct FieldPoint {
  const Triangle& triangle;
  double u = 0, v = 0;  // barycentrics of corners 1 and 2
  Vec3d normal, view;   // unit; the view points to the eye
  Vec3d f0;             // of the surface's specular lobe, and its roughness: for what is kept apart
  double roughness = 1;
  Vec3d place;  // for lamps
  Vec3d color;  // of its diffuse layer, (1 - metallic) base colour: for (2)
};

/// `sky` is null where the field has no visibility of it.
Vec3d seen_radiance(const LightField&, const MirroredSky* sky, const FieldPoint&);

}  // namespace kiln
