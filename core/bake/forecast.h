#pragma once
// What a bake will cost, told before it: a pilot of the rays it is going to send, and counts of where it sends them.
//
// Mesh     T triangles with B boundary edges have about V = (T + B) / 2 vertices and E = (3 T + B) / 2 edges; where T
//          becomes g T by splitting, B becomes B sqrt(g)
// Points   subdivision asks for light at V + E points and, roughly, at T; a mesh that is not split at its V
// Seconds  direct rays as in the pilot, reflected ones at kReflectedPrice times theirs; the rest by vertices
// Error    seconds, memory and bytes: `kiln_forecast` (tests/bench) prints predicted / measured

#include <cstdint>

#include "core/base/threads.h"
#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace kiln {

struct Plan;

/// Of one point of the surface, in the mean over a few hundred.
struct PointCosts {
  int samples = 1;       // most rays for distant light, when this was measured
  double sky_rays = 0;   // until the plan's noise was reached
  double sky_light = 0;  // of a white point under radiance 1: 1 in the open, 0 where no sky is seen
  double lamp_rays = 0;
  double sky_seconds = 0;  // with the threads of the pilot
  double lamp_seconds = 0;
};

/// Cost some hundredths of a second. The seconds are those of this machine, now; all else repeats.
PointCosts measure_costs(const Tracer&, const Plan&, Threads&);

/// Numbers known before the bake.
struct Prediction {
  std::uint64_t triangles = 0, vertices = 0;
  std::uint64_t memory_bytes = 0;  // of the process, at its peak
  std::uint64_t rays = 0;          // but for the certificate's
  double seconds = 0;
  std::uint64_t artifact_bytes = 0;
};

/// Of one bake as planned, by plan.costs. `scene` is the input.
Prediction predict(const Plan&, const Scene&);

}  // namespace kiln
