#pragma once
// Where a lamp may hang: random places in the room between surfaces.
// From an even point of the surface, on a side that is not inside a solid, a cosine ray goes to what it meets, or to
// the edge of the unit cube grown by a tenth; the place lies at an even share between .1 and .9 of it. It does not
// count with a surface within a tenth of the median length of such rays, inside a solid, or where less than a quarter
// of what it sees is surface on the side of its vertex normals. Cost    about 64 rays for each of 256 + 64 count
// candidates at most Repeat  a pure function of scene, count and seed.   Fewer than `count` where the scene has no room

#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/trace/tracer.h"

namespace kiln {

std::vector<Vec3f> free_places(const Tracer&, std::size_t count, std::uint64_t seed);

/// Whether a place counts, as said above.
bool hangs_free(const Tracer&, const Vec3f& place);

}  // namespace kiln
