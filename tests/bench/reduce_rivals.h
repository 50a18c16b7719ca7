#pragma once
// In-core simplifiers of others, for tests/bench/reduce.cpp.

#include "core/reduce/surface.h"

namespace kiln::bench {

/// Quadrics and normal flipping, as OpenMesh's own tools set them. Only where KILN_OPENMESH is defined.
void simplify_openmesh(Surface&, std::size_t triangles);

}  // namespace kiln::bench
