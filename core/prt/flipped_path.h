#pragma once
// Light from the side of a surface that no vertex stands for: the back of a double-sided face, by a path.

#include "core/base/random.h"
#include "core/prt/lamps.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Where a path's light is added: a row of 3 x order^2 numbers channel by channel, and lamp light.
struct PathSum {
  int order = 6;
  float* rows = nullptr;
  Vec3f* fixed = nullptr;  // null: the scene has no lamps
};

/// A hit from the flipped side, and how it goes on.
struct FlippedHit {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;
  Vec3f direction;      // of the ray that hit
  int reflections = 0;  // that may follow the one at this hit
};

/// Adds the radiance that leaves the flipped side towards where the ray came from, of light reflected there and at
/// most `reflections` times before. Unbiased. Returns the rays it took; speed matters little, such hits are few.
int add_flipped_path(const Tracer&, const Lamps&, FlippedHit hit, Random& random, const PathSum& sum);

}  // namespace kiln
