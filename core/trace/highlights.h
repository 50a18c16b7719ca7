#pragma once
// What punctual lights send to an eye by a surface's GGX lobe: the part that trace_specular() leaves out.
//   sum over lights of V f(l, v) (n.l) E
// Units   W m^-2 sr^-1.   Error   exact, by one shadow ray for each light.   Repeat  a pure function of its arguments

#include "core/base/vec.h"
#include "core/trace/reference.h"
#include "core/trace/tracer.h"

namespace kiln {

Vec3d punctual_highlights(const Tracer&, const EyedPoint&);

}  // namespace kiln
