#pragma once
// An irradiance vector grid as it is stored and read: parts of nine or twelve textures over a lattice, and which
// corners of a cell a place may look at.
//   E(p, n) = blend of the parts, each interpolated between the corners of p's cell that count there               (1)
// Corners  A bit for each corner of the cell. At a surface the bits of the axis its normal is nearest to, so that the
//          two sides of a thin wall look at different corners; a plane through the cell may part places of one
//          direction, as a floor inside and outside of a wall. In free space the bits of the eighth of the cell.
//          No bits: as if all were set (the values of vertices inside solids are filled from their neighbours').
// Paper    Pacanowski et al. 2006, section 3-3.   Differs  visibility of corners (the paper has none and leaks)
// Cost     trilinear: 9 x 8 or 6 x 8 reads of RGB

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/vec.h"
#include "core/grid/irradiance_vectors.h"
#include "core/grid/lattice.h"

namespace kiln {

enum class GridBlend { exact, paper };
enum class GridContent { indirect, all };

/// Corners of a cell or, where places see none of their own, of a neighbour that they see: kOwnCell, or
/// (dz + 1) 9 + (dy + 1) 3 + dx + 1. Places are moved into that cell.
struct CornerSet {
  static constexpr std::uint8_t kOwnCell = 13, kCells = 27;
  std::uint8_t cell = kOwnCell, bits = 0;
  friend bool operator==(const CornerSet&, const CornerSet&) = default;
};

/// Corners on the two sides of a plane through the cell, as coarse as a byte each for where it looks and where it
/// stands:
///   above where  80 (m . (f - 1/2)) + 128 >= offset;  offset 0: below everywhere                                  (2)
/// f is the place in the cell, m of direction 81 a + 9 i + j is 1 along axis a, i / 4 - 1 along the next, j / 4 - 1
/// along the one after it.
struct CornerCut {
  static constexpr int kDirectionsOfPlanes = 243;
  std::uint8_t direction = 0, offset = 0;
  CornerSet below, above;

  static Vec3d normal(int direction) {
    const auto axis = static_cast<std::size_t>(direction / 81);
    Vec3d m;
    m[axis] = 1, m[(axis + 1) % 3] = direction / 9 % 9 / 4.0 - 1, m[(axis + 2) % 3] = direction % 9 / 4.0 - 1;
    return m;
  }
  /// What is compared with the offset.
  static double height(const Vec3d& m, const std::array<double, 3>& f) {
    return 80 * (m.x * (f[0] - 0.5) + m.y * (f[1] - 0.5) + m.z * (f[2] - 0.5)) + 128;
  }
  const CornerSet& at(const std::array<double, 3>& fraction) const {
    return offset != 0 && height(normal(direction), fraction) >= offset ? above : below;
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

/// The cell that a look-up reads, the place in it, and the corners that count.
struct CornersRead {
  CellPlace place;
  std::uint8_t bits = 0xff;
};
CornersRead corners_read(const Grid&, const Vec3d& position, const Vec3f& n, GridPlace);
/// The neighbour of a cell that a CornerSet names, and the place moved into it; nothing beyond the lattice.
std::optional<CellPlace> moved_into(const Lattice&, const CellPlace&, std::uint8_t cell);

/// The corners of a trilinear look-up and their weights, which sum to 1.
struct LinearRead {
  std::array<std::uint32_t, 8> vertex{};
  std::array<float, 8> weight{};
};
LinearRead linear_read(const Lattice&, const CornersRead&);

}  // namespace kiln
