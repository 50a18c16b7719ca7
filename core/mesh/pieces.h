#pragma once
// How large the connected pieces of a mesh are.

#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

/// For each vertex the diagonal of the box of its piece: what triangles connect, vertices at one position being one
/// (bit-equal, -0 counts as +0). 0 for a vertex of no triangle.    Cost  O(n) expected
std::vector<float> piece_diagonals(const Mesh&);

}  // namespace kiln
