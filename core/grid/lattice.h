#pragma once
// Where the vertices of a grid stand: in the middles of equal boxes that fill a box, as texels of a 3D texture do.
//   vertex (i, j, k) at origin + (i, j, k) x spacing;  index (k ny + j) nx + i                                      (1)
// So they keep half a spacing from the box's own walls, which in a room are walls; beyond the outermost vertices their
// values go on unchanged (clamp to edge).
// Cells    lie between vertices: max(1, n - 1) along each axis, (cz cy_count + cy) cx_count + cx
// Units    any; bakes use the unit cube, artefacts the world

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/vec.h"

namespace kiln {

struct Lattice {
  std::array<int, 3> size{1, 1, 1};
  Vec3d origin, spacing{1, 1, 1};

  std::size_t vertices() const { return count(size[0]) * count(size[1]) * count(size[2]); }
  std::size_t index(const std::array<int, 3>& at) const {
    return (count(at[2]) * count(size[1]) + count(at[1])) * count(size[0]) + count(at[0]);
  }
  std::array<int, 3> vertex(std::size_t index) const {
    const std::size_t x = count(size[0]), y = count(size[1]);
    return {static_cast<int>(index % x), static_cast<int>(index / x % y), static_cast<int>(index / (x * y))};
  }
  Vec3d position(const std::array<int, 3>& at) const {
    return origin + Vec3d{spacing.x * at[0], spacing.y * at[1], spacing.z * at[2]};
  }

  std::array<int, 3> cells() const {
    return {std::max(1, size[0] - 1), std::max(1, size[1] - 1), std::max(1, size[2] - 1)};
  }
  std::size_t cell_count() const {
    const auto [x, y, z] = cells();
    return count(x) * count(y) * count(z);
  }
  std::size_t cell_index(const std::array<int, 3>& cell) const {
    const auto [x, y, z] = cells();
    return (count(cell[2]) * count(y) + count(cell[1])) * count(x) + count(cell[0]);
  }
  std::array<int, 3> cell(std::size_t index) const {
    const auto [x, y, z] = cells();
    const std::size_t nx = count(x), ny = count(y);
    return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny), static_cast<int>(index / (nx * ny))};
  }
  /// Corner 0..7 of a cell: bit 0 is one step along x, bit 1 along y, bit 2 along z.
  std::array<int, 3> corner(const std::array<int, 3>& cell, int which) const {
    return {std::min(cell[0] + (which & 1), size[0] - 1), std::min(cell[1] + (which >> 1 & 1), size[1] - 1),
            std::min(cell[2] + (which >> 2 & 1), size[2] - 1)};
  }

 private:
  static std::size_t count(int n) { return static_cast<std::size_t>(n); }
};

/// A place in its cell; places beyond the outermost vertices are moved to them first.
struct CellPlace {
  std::array<int, 3> cell{};
  std::array<double, 3> fraction{};  // in [0, 1]
};
CellPlace place_in(const Lattice&, const Vec3d& position);

/// The area of the smallest face of a cell.
double smallest_face(const Lattice&);

/// The lattice of `size` over a box. An axis without extent gets a spacing of the longest axis's.
Lattice lattice_over(const Vec3d& low, const Vec3d& high, const std::array<int, 3>& size);

/// The size whose spacing along each axis is nearest to that of `longest` vertices along the longest one.
std::array<int, 3> even_size(const Vec3d& low, const Vec3d& high, int longest);

}  // namespace kiln
