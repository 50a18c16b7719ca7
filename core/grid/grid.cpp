#include "core/grid/grid.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace kiln {
namespace {

/// Vertices with weights that sum to 1.
struct Stencil {
  std::array<std::size_t, 64> vertex;
  std::array<float, 64> weight;
  std::size_t count = 0;

  void add(std::size_t at, double by) { vertex[count] = at, weight[count++] = static_cast<float>(by); }
  Vec3f apply(const std::vector<Vec3f>& values) const {
    Vec3f sum;
    for (std::size_t i = 0; i < count; ++i) sum += values[vertex[i]] * weight[i];
    return sum;
  }
};

/// Corners that do not count leave their weight to the others; a little of it is everyone's, so that there is some.
std::array<double, 8> linear_weights(const CornersRead& at) {
  constexpr double kLeast = 1e-3;
  const double least = at.bits == 0xff ? 0 : kLeast;
  std::array<double, 8> weight{};
  double sum = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    if ((at.bits >> k & 1) == 0) continue;
    weight[k] = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double f = at.place.fraction[axis];
      weight[k] *= ((k >> axis & 1) != 0 ? f : 1 - f) + least;
    }
    sum += weight[k];
  }
  for (double& w : weight) w /= sum;
  return weight;
}

Stencil linear_stencil(const Lattice& lattice, const CornersRead& at) {
  const std::array<double, 8> weight = linear_weights(at);
  Stencil out;
  for (int k = 0; k < 8; ++k) {
    const double w = weight[static_cast<std::size_t>(k)];
    if (w > 0) out.add(lattice.index(lattice.corner(at.place.cell, k)), w);
  }
  return out;
}

/// Catmull and Rom 1974.
std::array<double, 4> cubic_weights(double f) {
  return {((-0.5 * f + 1) * f - 0.5) * f, (1.5 * f - 2.5) * f * f + 1, ((-1.5 * f + 2) * f + 0.5) * f,
          (0.5 * f - 0.5) * f * f};
}

Stencil cubic_stencil(const Lattice& lattice, const CellPlace& place) {
  std::array<std::array<double, 4>, 3> w;
  for (std::size_t axis = 0; axis < 3; ++axis) w[axis] = cubic_weights(place.fraction[axis]);
  const auto along = [&](std::size_t axis, int step) {
    return std::clamp(place.cell[axis] + step - 1, 0, lattice.size[axis] - 1);
  };
  Stencil out;
  for (int k = 0; k < 64; ++k) {
    const int x = k & 3, y = k >> 2 & 3, z = k >> 4;
    out.add(lattice.index({along(0, x), along(1, y), along(2, z)}),
            w[0][static_cast<std::size_t>(x)] * w[1][static_cast<std::size_t>(y)] * w[2][static_cast<std::size_t>(z)]);
  }
  return out;
}

template <std::size_t N>
std::array<Vec3f, N> read_parts(const Grid& grid, const Stencil& stencil) {
  std::array<Vec3f, N> out;
  for (std::size_t k = 0; k < N; ++k) out[k] = stencil.apply(grid.parts[k]);
  return out;
}

}  // namespace

std::size_t nearest_direction(const Vec3f& n) {
  const float x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  return direction_on(x >= y && x >= z ? 0 : y >= z ? 1 : 2, n);
}

std::optional<CellPlace> moved_into(const Lattice& lattice, const CellPlace& place, std::uint8_t cell) {
  const std::array<int, 3> step{cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1}, cells = lattice.cells();
  CellPlace out = place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.cell[axis] += step[axis];
    out.fraction[axis] = std::clamp(place.fraction[axis] - step[axis], 0.0, 1.0);
    if (out.cell[axis] < 0 || out.cell[axis] >= cells[axis]) return std::nullopt;
  }
  return out;
}

CornersRead corners_read(const Grid& grid, const Vec3d& position, const Vec3f& n, GridPlace kind) {
  const CellPlace place = place_in(grid.lattice, position);
  if (grid.cells.empty() || kind == GridPlace::anywhere) return {place};
  const CellCorners& cell = grid.cells[grid.lattice.cell_index(place.cell)];
  if (kind == GridPlace::surface) {
    const CornerSet& set = cell.surface[nearest_direction(n)].at(place.fraction);
    const auto moved = moved_into(grid.lattice, place, set.cell);
    if (set.bits != 0 && moved) return {*moved, set.bits};
  }
  const auto& f = place.fraction;
  const std::uint8_t bits = cell.room[(f[0] < 0.5 ? 0U : 1U) | (f[1] < 0.5 ? 0U : 2U) | (f[2] < 0.5 ? 0U : 4U)];
  return {place, bits == 0 ? std::uint8_t{0xff} : bits};
}

LinearRead linear_read(const Lattice& lattice, const CornersRead& at) {
  const std::array<double, 8> weight = linear_weights(at);
  LinearRead out;
  for (std::size_t k = 0; k < 8; ++k) {
    out.vertex[k] = static_cast<std::uint32_t>(lattice.index(lattice.corner(at.place.cell, static_cast<int>(k))));
    out.weight[k] = static_cast<float>(weight[k]);
  }
  return out;
}

Vec3f irradiance_at(const Grid& grid, const Vec3d& position, const Vec3f& n, GridPlace kind, GridFilter filter) {
  const CornersRead at = corners_read(grid, position, n, kind);
  const Stencil stencil = filter == GridFilter::cubic && at.bits == 0xff ? cubic_stencil(grid.lattice, at.place)
                                                                         : linear_stencil(grid.lattice, at);
  if (grid.blend == GridBlend::paper) return texel_irradiance(read_parts<kPaperParts>(grid, stencil), n);
  return exact_irradiance(read_parts<kExactParts>(grid, stencil), n);
}

}  // namespace kiln
