#pragma once
// Contact lines that run along edges.
//
// The two triangles of such an edge see different light at its ends. A vertex whose triangles fall apart at such edges
// becomes one vertex for each share of them, at the same place.
// Repeat  same results for any thread count   Memory  about 30 bytes a vertex while it works

#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/hidden.h"
#include "core/prt/pierce.h"

namespace kiln {

/// Parts vertices of the mesh. Returns those that were parted, old and new, ascending, with the points whose light they
/// have: past what stands there, on the side of their largest triangle.
std::vector<StandIn> part_vertices(Mesh&, const PierceTest&, Threads&);

}  // namespace kiln
