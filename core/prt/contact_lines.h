#pragma once
// Contact lines: where other surfaces stand on a triangle or pierce it, the foot of a column, a beam in a wall. Light
// jumps there.
//
// Lines are those of the triangle's plane a hair above it: what touches it exactly stands on it, what lies in its plane
// does not.   Repeat  same bits for any thread count

#include <vector>

#include "core/base/threads.h"
#include "core/prt/cut_line.h"

namespace kiln {

/// All lines that triangles with `stands[t]` make on the mesh, by triangle, of one triangle the longest first and at
/// most most_lines(). What lies within three degrees of its plane makes none: tiles that overlap.
std::vector<CutLine> find_contact_lines(const Mesh&, const std::vector<bool>& stands, Threads&);

}  // namespace kiln
