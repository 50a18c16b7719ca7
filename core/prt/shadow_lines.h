#pragma once
// Shadow lines: where the shadows of punctual lights end on a surface. Such lights have no size, so that light jumps
// there.
//
// An edge casts a shadow line where all faces around it lie on one side of the plane through it and the light. Rays
// past it find the triangles that the line falls on, more of them where two neighbours differ; on each the line is then
// exact: where the plane through edge and light meets the triangle's plane, a hair above it, where rays start.
// Missed      what is behind less than 1/256 of an edge; shadows of masked and blended parts
// Cost        about nine pairs of rays for a silhouette edge and two for each triangle that its line crosses
// Repeat      same bits for any thread count

#include <vector>

#include "core/base/threads.h"
#include "core/prt/cut_line.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Of all punctual lights, by edges of triangles with `casts[t]`; by triangle, at most most_lines() of each.
std::vector<CutLine> find_shadow_lines(const Tracer&, const std::vector<bool>& casts, Threads&);

}  // namespace kiln
