#pragma once
// Whether two places of a surface see each other.
// Straight, or over what lies between when both rise along their normals by a quarter of their distance: surfaces that
// bulge hide neighbours a hair above them. A thin wall parts what lies on its two sides.
// Cost    one packet of rays for all places, and up to three rays for each that is not seen straight
// Repeat  a pure function of its arguments

#include <cstdint>
#include <span>

#include "core/meshless/points.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Bit i: whether `from` and to[i] see each other; at most kPacket places.
std::uint32_t in_sight(const Tracer&, const SurfaceSite& from, std::span<const SurfaceSite> to);

inline bool in_sight(const Tracer& tracer, const SurfaceSite& a, const SurfaceSite& b) {
  return in_sight(tracer, a, std::span(&b, 1)) != 0;
}

}  // namespace kiln
