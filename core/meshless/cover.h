#pragma once
// Which places stand in a gap: something is straight above their face, nearer than points are apart.
// What leaves the ceiling over a lamp, the wall behind a picture or the floor under a rug differs from what leaves the
// same surface beside them, and no point on one side says anything of the other: the two are groups of their own, which
// place, answer and are read apart.
// Units   unit-cube lengths.   Cost  one short ray.   Repeat  a pure function of its arguments

#include <cstdint>

#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

inline constexpr std::uint32_t kOpenGroup = 0, kCoveredGroup = 1, kGroups = 2;

/// `cover`: R of the finest level, from which what is above is far. A vertex is asked a twentieth of it inside its
/// face, clear of edges and of what stands there.
std::uint32_t group_of(const Tracer&, const TransferPoint&, float cover);

/// Where that is: as far inside the face as a reader looks from.
Vec3f inside_face(const TransferPoint&, float cover);

}  // namespace kiln
