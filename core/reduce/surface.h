#pragma once
// A surface on its way from many triangles to few: vertices that remember the planes they stand for.

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/quadric.h"

namespace kiln {

/// What a vertex stands for.
struct Sample {
  Quadric quadric;
  Vec3f color;        // sum of weight times linear colour
  double weight = 0;  // area
  Vec3f mean_color() const { return weight > 0 ? color * static_cast<float>(1 / weight) : Vec3f{1, 1, 1}; }
};

struct Surface {
  std::vector<Vec3d> position;  // unit cube
  std::vector<Sample> sample;   // of each position
  std::vector<Triangle> triangles;
};

/// Where the unit cube lies: world = center + scale * unit.
struct UnitFrame {
  Vec3d center;
  double scale = 1;
  Vec3d to_unit(const Vec3d& p) const { return (p - center) / scale; }
};

/// Drops vertices that no triangle uses. Order is kept.
void drop_unused(Surface&);

}  // namespace kiln
