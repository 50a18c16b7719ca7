#pragma once
// Where the vertices of a grid stand: in the middles of equal boxes that fill a box, as texels of a 3D texture do.
//   vertex (i, j, k) at origin + (i, j, k) x spacing;  index (k ny + j) nx + i                                      (1)
// So they keep half a spacing from the box's own walls, which in a room are walls; beyond the outermost vertices their
// values go on unchanged (clamp to edge).
// Cells    lie between vertices: max(1, n - 1) along each axis, (cz cy_count + cy) cx_count + cx
// Bricks   A lattice may be stored in part: in blocks of kSide x kSide x kSide cells, with the vertices at their
//          corners. Then vertices and cells are numbered as they are stored, and what is not has the number kNone.
// Units    any; bakes use the unit cube, artefacts the world

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

/// Cell (x, y, z) lies in block (x, y, z) / kSide, at (x, y, z) % kSide; vertices of a block are numbered likewise, 0
/// to kSide along each axis. Both count along x first, then y. Beyond the lattice's last vertex stands that vertex.
struct Bricks {
  static constexpr int kSide = 4, kVertices = (kSide + 1) * (kSide + 1) * (kSide + 1), kCells = kSide * kSide * kSide;

  std::array<int, 3> blocks{};        // along each axis
  std::vector<std::int32_t> number;   // [block] of its brick; -1: not stored
  std::vector<std::uint32_t> block;   // [brick]
  std::vector<std::uint32_t> vertex;  // [brick][kVertices] the number of each of its vertices
  std::vector<std::uint64_t> place;   // [number of a vertex] its index in the whole lattice; ascending
};

struct Lattice {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  std::array<int, 3> size{1, 1, 1};
  Vec3d origin, spacing{1, 1, 1};
  Bricks bricks = {};  // none: all of it is stored

  bool in_bricks() const { return !bricks.block.empty(); }
  std::size_t vertices() const {
    return in_bricks() ? bricks.place.size() : count(size[0]) * count(size[1]) * count(size[2]);
  }
  /// kNone where it is not stored.
  std::size_t index(const std::array<int, 3>& at) const { return in_bricks() ? index_in_bricks(at) : whole_index(at); }
  std::size_t whole_index(const std::array<int, 3>& at) const {
    return (count(at[2]) * count(size[1]) + count(at[1])) * count(size[0]) + count(at[0]);
  }
  std::array<int, 3> vertex(std::size_t index) const {
    if (in_bricks()) index = bricks.place[index];
    const std::size_t x = count(size[0]), y = count(size[1]);
    return {static_cast<int>(index % x), static_cast<int>(index / x % y), static_cast<int>(index / (x * y))};
  }
  Vec3d position(const std::array<int, 3>& at) const {
    return origin + Vec3d{spacing.x * at[0], spacing.y * at[1], spacing.z * at[2]};
  }

  std::array<int, 3> cells() const {
    return {std::max(1, size[0] - 1), std::max(1, size[1] - 1), std::max(1, size[2] - 1)};
  }
  /// In bricks a few that count lie beyond the lattice.
  std::size_t cell_count() const {
    const auto [x, y, z] = cells();
    return in_bricks() ? bricks.block.size() * Bricks::kCells : count(x) * count(y) * count(z);
  }
  /// kNone where it is not stored.
  std::size_t cell_index(const std::array<int, 3>& cell) const {
    if (in_bricks()) {
      const std::size_t brick = brick_of(cell);
      return brick == kNone ? kNone : brick * Bricks::kCells + local_index(cell, Bricks::kSide);
    }
    const auto [x, y, z] = cells();
    return (count(cell[2]) * count(y) + count(cell[1])) * count(x) + count(cell[0]);
  }
  bool holds(const std::array<int, 3>& cell) const { return !in_bricks() || brick_of(cell) != kNone; }
  std::array<int, 3> cell(std::size_t index) const {
    if (in_bricks()) return cell_in_bricks(index);
    const auto [x, y, z] = cells();
    const std::size_t nx = count(x), ny = count(y);
    return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny), static_cast<int>(index / (nx * ny))};
  }
  /// Corner 0..7 of a cell: bit 0 is one step along x, bit 1 along y, bit 2 along z.
  std::array<int, 3> corner(const std::array<int, 3>& cell, int which) const {
    return {std::min(cell[0] + (which & 1), size[0] - 1), std::min(cell[1] + (which >> 1 & 1), size[1] - 1),
            std::min(cell[2] + (which >> 2 & 1), size[2] - 1)};
  }
  /// Its number; the cell is stored.
  std::size_t corner_index(const std::array<int, 3>& cell, int which) const {
    if (!in_bricks()) return index(corner(cell, which));
    const std::array<int, 3> at{cell[0] % Bricks::kSide + (which & 1), cell[1] % Bricks::kSide + (which >> 1 & 1),
                                cell[2] % Bricks::kSide + (which >> 2 & 1)};
    return bricks.vertex[brick_of(cell) * Bricks::kVertices + flat_index(at, Bricks::kSide + 1)];
  }
  std::array<int, 3> block_of(const std::array<int, 3>& cell) const {
    return {cell[0] / Bricks::kSide, cell[1] / Bricks::kSide, cell[2] / Bricks::kSide};
  }

 private:
  static std::size_t flat_index(const std::array<int, 3>& at, int side) {
    return (count(at[2]) * count(side) + count(at[1])) * count(side) + count(at[0]);
  }
  static std::size_t local_index(const std::array<int, 3>& cell, int side) {
    return flat_index({cell[0] % side, cell[1] % side, cell[2] % side}, side);
  }
  std::size_t brick_of(const std::array<int, 3>& cell) const {
    const auto [x, y, z] = block_of(cell);
    const auto& n = bricks.blocks;
    const std::int32_t brick = bricks.number[(count(z) * count(n[1]) + count(y)) * count(n[0]) + count(x)];
    return brick < 0 ? kNone : static_cast<std::size_t>(brick);
  }
  std::size_t index_in_bricks(const std::array<int, 3>& at) const;
  std::array<int, 3> cell_in_bricks(std::size_t index) const;
  static std::size_t count(int n) { return static_cast<std::size_t>(n); }
};

/// A place in its cell; places beyond the outermost vertices are moved to them first.
struct CellPlace {
  std::array<int, 3> cell{};
  std::array<double, 3> fraction{};  // in [0, 1]
};
CellPlace place_in(const Lattice&, const Vec3d& position);

/// The lattice stored in the blocks of these numbers alone: (z blocks along y + y) blocks along x + x, ascending.
Lattice in_bricks(Lattice, std::vector<std::uint32_t> blocks);
/// Lattice k beyond a base, whole: 2^(k + 1) times as many vertices along each axis, over the same box.
Lattice finer_lattice(const Lattice& base, std::size_t k);
/// How many blocks a lattice has along each axis.
std::array<int, 3> blocks_along(const Lattice&);

/// The area of the smallest face of a cell.
double smallest_face(const Lattice&);

/// The lattice of `size` over a box. An axis without extent gets a spacing of the longest axis's.
Lattice lattice_over(const Vec3d& low, const Vec3d& high, const std::array<int, 3>& size);

/// The size whose spacing along each axis is nearest to that of `longest` vertices along the longest one.
std::array<int, 3> even_size(const Vec3d& low, const Vec3d& high, int longest);

}  // namespace kiln
