#pragma once
// How many reflections a scene needs, measured: the light that paths of growing length bring to a few points.

#include "core/base/threads.h"
#include "core/trace/tracer.h"

namespace kiln {

inline constexpr float kWhite = 0.95F;  // paper and paint are at most .9

struct BounceTail {
  int bounces = 0;   // the fewest after which the rest stays within the tail
  double left = 0;   // of the light, beyond those (against kLongest reflections), in the worst lighting
  double white = 0;  // share of the surface that reflects more than kWhite of the light
};

/// `tail` is the share of the light that may be left out, under a constant sky and, with `lamps`, under the scene's own
/// lights; a lighting that hardly reaches the surface does not count. At most 32 reflections.
/// Cost about 0.1 s.   Repeat  same numbers for any thread count.
BounceTail measure_bounces(const Tracer&, bool lamps, double tail, Threads&);

}  // namespace kiln
