#include "core/grid/lattice.h"

#include <utility>

namespace kiln {
namespace {

double longest_side(const Vec3d& extent) { return std::max({extent.x, extent.y, extent.z, 1e-300}); }

/// The places of the vertices of a brick in the whole lattice.
std::vector<std::uint64_t> places_of(const Lattice& lattice, std::uint32_t block) {
  const auto& n = lattice.bricks.blocks;
  const auto number = static_cast<int>(block);
  const std::array<int, 3> low{number % n[0] * Bricks::kSide, number / n[0] % n[1] * Bricks::kSide,
                               number / (n[0] * n[1]) * Bricks::kSide};
  std::vector<std::uint64_t> out;
  for (int z = 0; z <= Bricks::kSide; ++z) {
    for (int y = 0; y <= Bricks::kSide; ++y) {
      for (int x = 0; x <= Bricks::kSide; ++x) {
        const std::array<int, 3> step{x, y, z};
        std::array<int, 3> at{};
        for (std::size_t axis = 0; axis < 3; ++axis)
          at[axis] = std::min(low[axis] + step[axis], lattice.size[axis] - 1);
        out.push_back(lattice.whole_index(at));
      }
    }
  }
  return out;
}

}  // namespace

std::size_t Lattice::index_in_bricks(const std::array<int, 3>& at) const {
  const std::array<int, 3> last = cells();
  for (int k = 0; k < 8; ++k) {
    // The cell of which the vertex is corner k.
    std::array<int, 3> cell{};
    bool within = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cell[axis] = at[axis] - (k >> axis & 1);
      within = within && cell[axis] >= 0 && cell[axis] < last[axis];
    }
    if (within && holds(cell)) return corner_index(cell, k);
  }
  return kNone;
}

std::array<int, 3> Lattice::cell_in_bricks(std::size_t index) const {
  const auto block = static_cast<int>(bricks.block[index / Bricks::kCells]);
  const auto local = static_cast<int>(index % Bricks::kCells);
  const auto& n = bricks.blocks;
  constexpr int kSide = Bricks::kSide;
  return {block % n[0] * kSide + local % kSide, block / n[0] % n[1] * kSide + local / kSide % kSide,
          block / (n[0] * n[1]) * kSide + local / (kSide * kSide)};
}

std::array<int, 3> blocks_along(const Lattice& lattice) {
  const auto [x, y, z] = lattice.cells();
  constexpr int kSide = Bricks::kSide;
  return {(x + kSide - 1) / kSide, (y + kSide - 1) / kSide, (z + kSide - 1) / kSide};
}

Lattice finer_lattice(const Lattice& base, std::size_t k) {
  Lattice out{.size = base.size};
  const double parts = std::ldexp(1.0, static_cast<int>(k) + 1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.size[axis] = base.size[axis] << (k + 1);
    out.spacing[axis] = base.spacing[axis] / parts;
    out.origin[axis] = base.origin[axis] - (base.spacing[axis] - out.spacing[axis]) / 2;
  }
  return out;
}

Lattice in_bricks(Lattice lattice, std::vector<std::uint32_t> blocks) {
  Bricks& bricks = lattice.bricks;
  bricks = {.blocks = blocks_along(lattice), .number = {}, .block = std::move(blocks), .vertex = {}, .place = {}};
  const auto& n = bricks.blocks;
  bricks.number.assign(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]),
                       -1);
  std::vector<std::uint64_t> all;
  for (std::size_t i = 0; i < bricks.block.size(); ++i) {
    bricks.number[bricks.block[i]] = static_cast<std::int32_t>(i);
    const std::vector<std::uint64_t> own = places_of(lattice, bricks.block[i]);
    all.insert(all.end(), own.begin(), own.end());
  }
  bricks.place = all;
  std::sort(bricks.place.begin(), bricks.place.end());
  bricks.place.erase(std::unique(bricks.place.begin(), bricks.place.end()), bricks.place.end());
  for (const std::uint64_t at : all) {
    const auto found = std::lower_bound(bricks.place.begin(), bricks.place.end(), at);
    bricks.vertex.push_back(static_cast<std::uint32_t>(found - bricks.place.begin()));
  }
  return lattice;
}

CellPlace place_in(const Lattice& lattice, const Vec3d& position) {
  CellPlace place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int last = lattice.size[axis] - 1;
    const double at = (position[axis] - lattice.origin[axis]) / lattice.spacing[axis];
    const double inside = std::isfinite(at) ? std::clamp(at, 0.0, double(last)) : 0.0;
    place.cell[axis] = std::clamp(static_cast<int>(inside), 0, std::max(0, last - 1));
    place.fraction[axis] = inside - place.cell[axis];
  }
  return place;
}

double smallest_face(const Lattice& lattice) {
  const Vec3d& s = lattice.spacing;
  return std::min({s.x * s.y, s.y * s.z, s.z * s.x});
}

Lattice lattice_over(const Vec3d& low, const Vec3d& high, const std::array<int, 3>& size) {
  const Vec3d extent = high - low;
  const double longest = longest_side(extent);
  Lattice lattice{.size = size};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double side = std::max(extent[axis], 1e-6 * longest);
    const double middle = (low[axis] + high[axis]) / 2;
    lattice.spacing[axis] = extent[axis] > 1e-6 * longest ? side / size[axis] : longest / size[axis];
    lattice.origin[axis] = middle - lattice.spacing[axis] * (size[axis] - 1) / 2;
  }
  return lattice;
}

std::array<int, 3> even_size(const Vec3d& low, const Vec3d& high, int longest) {
  const Vec3d extent = high - low;
  const double step = longest_side(extent) / longest;
  std::array<int, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size[axis] = std::clamp(static_cast<int>(std::lround(extent[axis] / step)), 1, longest);
  }
  return size;
}

}  // namespace kiln
