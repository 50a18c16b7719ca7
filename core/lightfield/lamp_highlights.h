#pragma once
// What surfaces mirror of punctual lamps, for light fields that keep these apart: a highlight is as narrow as the lobe,
// and no series of few bands holds one.
//   sum over lamps k of V_k E_k f(l_k, v) (n.l_k),   f = (F0 + (1 - F0) (1 - l.h)^5) D V                           (1)
// f is the lobe of core/trace/ggx.h and E_k, l_k are core/trace/lights.h, both at the place itself: exact but for V_k,
// the share of the lamp that is seen (nothing in its way, whatever its cone), which is known at vertices and
// interpolated between them. Units   W m^-2 sr^-1; lengths of the unit cube.   Repeat  a pure function of its arguments

#include <span>

#include "core/lightfield/light_field.h"

namespace kiln {

struct LampEye {
  Vec3d place, normal, view;  // unit, the view points to the eye; one below the horizon counts as at it
  Vec3d f0;
  double roughness = 1;
};
/// Equation 1. `seen`: V of each lamp.
Vec3d lamp_highlights(std::span<const FieldLamp>, std::span<const double> seen, const LampEye&);

}  // namespace kiln
