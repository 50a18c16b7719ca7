#pragma once
// Random baked scenes whose vertices carry their own number, so that a test finds them again after Draco's reordering.

#include <cstdint>
#include <vector>

#include "core/artifact/baked_scene.h"

namespace kiln {

struct RandomBaked {
  int order = 3, channels = 3;
  bool fixed = false;
  double magnitude = 1;  // of the coefficients
  int side = 12;         // quads along a side of each part's grid
  std::uint64_t seed = 1;
};

/// Four height-field parts side by side that share borders in space: plain, uv, uv and vertex colours, everything.
/// Flat slot 0 of vertex v holds v (so magnitude does not apply to it), all others are random in [-magnitude,
/// magnitude].
BakedScene random_baked(const RandomBaked&);

/// For each vertex of `read` the vertex of the written scene that it was, read back from flat slot 0.
std::vector<std::uint32_t> original_vertices(const BakedScene& read);

}  // namespace kiln
