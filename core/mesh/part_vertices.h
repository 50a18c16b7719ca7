#pragma once
// Vertices parted along edges: a vertex whose triangles fall apart there becomes one for each share of them.

#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

/// Two vertices, the lower first.
using MeshEdge = std::pair<std::uint32_t, std::uint32_t>;

/// Parts the vertices on some edges (ascending). The share of a vertex's first triangle keeps it, the others get copies
/// at the end of the list.
void part_vertices(Mesh&, const std::vector<MeshEdge>& edges);

}  // namespace kiln
