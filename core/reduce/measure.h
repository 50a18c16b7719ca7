#pragma once
// The first pass: how large a model is, while all its numbers are checked.

#include "core/reduce/surface.h"
#include "core/reduce/triangle_source.h"

namespace kiln {

struct Extent {
  Vec3d low, high;  // world
  double area = 0;  // world
  std::uint64_t triangles = 0;
  UnitFrame frame() const;
};

/// Memory  one batch.   Repeat  same bits for any thread count.   Fails  as the source does
Result<Extent> measure(const TriangleSource&, Threads&);

}  // namespace kiln
