#include "core/grid/lattice.h"

namespace kiln {
namespace {

double longest_side(const Vec3d& extent) { return std::max({extent.x, extent.y, extent.z, 1e-300}); }

}  // namespace

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
