#pragma once
// The certificate of a light field: what the delivered file shows to eyes around it, against the path-traced reference
// under the job's own light in full detail.
//   truth = emission + below (1 - E(n.v)) diffuse + specular + highlights of punctual lights (lightfield/outgoing.h)
// Views   places even over the delivered surface, each with an eye even over the half space of the input's normal at
//         the nearest place that looks that way; of very many those are traced that are likely to be wrong, weighted so
//         that every figure is that of even ones (field_views.h). Places inside solids, which no eye sees, do not
//         count.
// Method  a pilot says how many eyes and how many paths for each (spending.h); where the reference is least trusted it
//         is traced again (second_look.h).
// Cost    about 5 % of the bake's rays, or a second
// Never changes the artefact.   Repeat  same numbers for any thread count.

#include <cstdint>
#include <optional>

#include "core/artifact/baked_scene.h"
#include "core/bake/error_stats.h"
#include "core/base/threads.h"
#include "core/scene/environment.h"
#include "core/trace/tracer.h"

namespace kiln {

struct FieldCertificate {
  ErrorStats radiance;
  std::size_t points = 0;
  int samples = 0;  // paths of a point, of each kind
  double seconds = 0;
};

struct FieldCheck {
  const BakedScene& decoded;
  const Tracer& truth;  // of the input's surface
  const std::optional<Environment>& environment;
  std::uint64_t bake_rays = 0;  // what the bake sent: the certificate costs about 5 % of it, or a second
  std::uint64_t seed = 0;
};

FieldCertificate certify_field(const FieldCheck&, Threads&);

}  // namespace kiln
