#pragma once
// Triangles across a contact line that was not cut.
//
// Where a line is cut on one edge of a triangle and leaves it uncut (there was no budget, or two surfaces cross there),
// one of its pieces lies on both sides and has a corner on the line. With the copy that belongs inside the solid there,
// a dark tooth would stand out of the contact line; with the other the light goes in, where nobody sees it.

#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/hidden.h"

namespace kiln {

/// `copies` are the vertices on contact lines, ascending, with the points whose light they have. Triangles of a hidden
/// one that have a corner that can be seen take the copy at the same place that is not hidden, if there is one.
void light_straddlers(Mesh&, const std::vector<StandIn>& copies, const HiddenTest&, Threads&);

}  // namespace kiln
