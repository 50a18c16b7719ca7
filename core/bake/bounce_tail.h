#pragma once
// How many reflections a scene needs, measured: the light that paths of growing length bring to a few points.

#include "core/base/threads.h"
#include "core/trace/tracer.h"

namespace kiln {

struct BounceTail {
  int bounces = 0;  // the fewest after which the rest stays within the tail
  double left = 0;  // of the light, beyond those (against kLongest reflections), in the worst lighting
};

/// `tail` is the share of the light that may be left out, under a constant sky and, with `lamps`, under the scene's own
/// lights; a lighting that hardly reaches the surface does not count. At most 32 reflections.
/// Cost about 0.1 s.   Repeat  same numbers for any thread count.
BounceTail measure_bounces(const Tracer&, bool lamps, double tail, Threads&);

}  // namespace kiln
