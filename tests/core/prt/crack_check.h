#pragma once
// Exact checks of a refined mesh against the mesh it came from.

#include <string>

#include "core/mesh/mesh.h"

namespace kiln::testing {

/// Walks every welded edge of `input` through `output`: at each level it must be there whole, with all its triangles,
/// or be cut at its exact middle, never both; and what is not on an input edge must lie inside triangles, shared by
/// an even number of them. Returns what is wrong, or an empty string.
std::string find_crack(const Mesh& input, const Mesh& output);

}  // namespace kiln::testing
