#pragma once
// The step `lightfield` on a file that carries its light (core/artifact/carried.md): nothing is traced. The field is
// simplified, stored and judged like a baked one, but against the field of the input and not against light.
// Certificate   at random points of the delivered surface, even by area, one eye each, even over the half space of the
//               input's normal at the nearest place: what the file shows it and what the input does. Over such eyes the
//               mean square of the difference is that of equation 5, wherever the normals agree.
// Repeat  same numbers for any thread count.

#include <cstdint>

#include "core/artifact/carried_scene.h"
#include "core/bake/light_field_certificate.h"
#include "core/bake/plan.h"
#include "core/bake/recipe.h"

namespace kiln {

/// `sky`: an environment was asked for, which has no effect.
Plan make_carried_plan(const CarriedScene&, const Recipe&, bool sky);

struct CarriedCheck {
  const BakedScene& decoded;
  const Mesh& surface;      // of the input,
  const LightField& field;  // and what it carries
  std::uint64_t seed = 0;
};

FieldCertificate certify_carried(const CarriedCheck&, Threads&);

}  // namespace kiln
