#pragma once
// How a model that does not fit into memory is brought down to one that does.

namespace kiln {

enum class ReduceMethod { cluster, adaptive };  // cells of one size, or the leaves of an octree (clusters.h)

}  // namespace kiln
