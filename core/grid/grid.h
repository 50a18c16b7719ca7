#pragma once
// An irradiance vector grid as it is stored and read: parts of nine or twelve textures over a lattice, and which
// corners of a cell a place may look at.
//   E(p, n) = blend of the parts, each interpolated between the corners of p's cell that count there               (1)
// Corners  A bit for each corner of the cell. At a surface the bits of the axis its normal is nearest to, so that the
//          two sides of a thin wall look at different corners; a cut through the cell may part places of one direction,
//          as a floor inside and outside of a wall. In free space the bits of the eighth of the cell.
//          No bits: as if all were set (the values of vertices inside solids are filled from their neighbours').
// Paper    Pacanowski et al. 2006, section 3-3.   Differs  visibility of corners (the paper has none and leaks)
// Cost     trilinear: 9 x 8 or 6 x 8 reads of RGB

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/grid/irradiance_vectors.h"
#include "core/grid/lattice.h"

namespace kiln {

enum class GridBlend { exact, paper };
enum class GridContent { indirect, all };

/// Bits on the two sides of the plane at (cut & 63) / 64 of the cell along axis cut >> 6; cut 0: `below` everywhere.
struct CornerCut {
  std::uint8_t cut = 0, below = 0, above = 0;

  std::uint8_t at(const std::array<double, 3>& fraction) const {
    return cut != 0 && fraction[cut >> 6] >= (cut & 63) / 64.0 ? above : below;
  }
  friend bool operator==(const CornerCut&, const CornerCut&) = default;
};

struct CellCorners {
  std::array<std::uint8_t, 8> room{};            // of each eighth, numbered as corners are
  std::array<CornerCut, kDirections> surface{};  // of normals nearest to +x -x +y -y +z -z
  friend bool operator==(const CellCorners&, const CellCorners&) = default;
};

struct Grid {
  Lattice lattice;
  GridBlend blend = GridBlend::exact;
  GridContent content = GridContent::indirect;
  std::vector<std::vector<Vec3f>> parts;  // [part][vertex]
  std::vector<CellCorners> cells;         // empty: every corner counts everywhere
};

constexpr std::size_t part_count(GridBlend blend) { return blend == GridBlend::exact ? kExactParts : kPaperParts; }

/// The direction among six that n is nearest to; of equals the first axis.
std::size_t nearest_direction(const Vec3f& n);

/// On a surface; in free space; or anywhere, with every corner counted.
enum class GridPlace { surface, room, anywhere };
enum class GridFilter { linear, cubic };

/// Equation 1, at least 0: irradiance in W m^-2 of a receiver at `position` (the lattice's lengths) with unit normal n.
/// Cubic is Catmull-Rom where all corners of the cell count, and linear elsewhere.
Vec3f irradiance_at(const Grid&, const Vec3d& position, const Vec3f& n, GridPlace = GridPlace::surface,
                    GridFilter = GridFilter::linear);

}  // namespace kiln
