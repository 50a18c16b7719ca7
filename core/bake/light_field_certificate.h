#pragma once
// The certificate of a light field: what the delivered file shows to eyes around it, against the path-traced reference
// under the job's own light in full detail.
//   truth = emission + below (1 - E(n.v)) diffuse + specular + highlights of punctual lights (lightfield/outgoing.h)
// Points  random on the delivered surface, even by area, each with an eye even over the half space of its normal; the
//         reference stands at the nearest place of the input surface with a compatible normal. Points inside solids,
//         which no eye sees, do not count.
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
  std::uint64_t bake_rays = 0;  // of which the certificate may take a twentieth
  std::uint64_t seed = 0;
};

FieldCertificate certify_field(const FieldCheck&, Threads&);

}  // namespace kiln
