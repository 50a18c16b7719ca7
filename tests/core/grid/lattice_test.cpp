// Places of a lattice, and interpolation over it.

#include "core/grid/lattice.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/grid/grid.h"

namespace kiln {
namespace {

TEST(Lattice, VerticesStandInTheMiddlesOfEqualBoxes) {
  const Lattice l = lattice_over({0, 0, 0}, {4, 2, 1}, {4, 2, 1});
  EXPECT_EQ(l.position({0, 0, 0}), (Vec3d{0.5, 0.5, 0.5}));
  EXPECT_EQ(l.position({3, 1, 0}), (Vec3d{3.5, 1.5, 0.5}));
  EXPECT_EQ(l.vertices(), 8U);
  EXPECT_EQ(l.cells(), (std::array<int, 3>{3, 1, 1}));
  for (std::size_t i = 0; i < l.vertices(); ++i) EXPECT_EQ(l.index(l.vertex(i)), i);
  for (std::size_t i = 0; i < l.cell_count(); ++i) EXPECT_EQ(l.cell_index(l.cell(i)), i);
}

TEST(Lattice, SpacingIsEvenAlongAllAxes) {
  EXPECT_EQ(even_size({0, 0, 0}, {1, 0.5, 0.26}, 16), (std::array<int, 3>{16, 8, 4}));
  EXPECT_EQ(even_size({0, 0, 0}, {1, 0, 0}, 16), (std::array<int, 3>{16, 1, 1}));
  EXPECT_EQ(even_size({1, 1, 1}, {1, 1, 1}, 16), (std::array<int, 3>{1, 1, 1}));
}

TEST(Lattice, OverNothingStillHasAPlaceForEverything) {
  const Lattice l = lattice_over({1, 1, 1}, {1, 1, 1}, {1, 1, 1});
  const CellPlace p = place_in(l, {5, 1, -3});
  EXPECT_EQ(p.cell, (std::array<int, 3>{0, 0, 0}));
  EXPECT_EQ(p.fraction, (std::array<double, 3>{0, 0, 0}));
}

/// A grid whose phi.x is f and whose other parts are zero; at n = +x it reads f / 2.
template <class F>
Grid grid_of(const Lattice& lattice, const F& f) {
  Grid grid{.lattice = lattice, .parts = std::vector(kExactParts, std::vector<Vec3f>(lattice.vertices()))};
  for (std::size_t v = 0; v < lattice.vertices(); ++v) {
    const auto x = static_cast<float>(2 * f(lattice.position(lattice.vertex(v))));
    grid.parts[0][v] = {x, x, x};
  }
  return grid;
}

const Lattice kLattice = lattice_over({0, 0, 0}, {6, 5, 4}, {6, 5, 4});

TEST(Grid, LinearInterpolationReproducesTrilinearFunctions) {
  const auto f = [](const Vec3d& p) { return 3 + p.x - p.y / 5 + p.z * p.x * p.y / 8; };
  const Grid grid = grid_of(kLattice, f);
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(1, i);
    Vec3d p;
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] = 0.5 + random.uniform_double() * (kLattice.size[axis] - 1);  // between the outermost vertices
    EXPECT_NEAR(irradiance_at(grid, p, {1, 0, 0}).x, f(p), 3e-5);           // floats of about 20
  }
}

TEST(Grid, CubicInterpolationReproducesQuadraticFunctionsInside) {
  // Catmull-Rom: third order where all of 4 x 4 x 4 vertices are there.
  const auto f = [](const Vec3d& p) { return 4 + p.x * p.x - p.y * p.y / 3 + p.x * p.y + 2 * p.z; };
  const Grid grid = grid_of(kLattice, f);
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(2, i);
    Vec3d p;
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] = 1.5 + random.uniform_double() * (kLattice.size[axis] - 3);  // one spacing inside them
    EXPECT_NEAR(irradiance_at(grid, p, {1, 0, 0}, GridPlace::surface, GridFilter::cubic).x, f(p), 1e-4);
  }
}

TEST(Grid, GoesOnUnchangedBeyondItsOutermostVertices) {
  const Grid grid = grid_of(kLattice, [](const Vec3d& p) { return p.x; });
  EXPECT_FLOAT_EQ(irradiance_at(grid, {-100, 2, 2}, {1, 0, 0}).x, 0.5F);
  EXPECT_FLOAT_EQ(irradiance_at(grid, {100, 2, 2}, {1, 0, 0}).x, 5.5F);
}

TEST(Grid, CornersThatDoNotCountLeaveTheirWeightToTheOthers) {
  // Light 1 at x < 3, 0 beyond; the cell from 2.5 to 3.5 has a wall in its middle. Each side of it looks at its own.
  Grid grid = grid_of(kLattice, [](const Vec3d& p) { return p.x < 3 ? 1.0 : 0.0; });
  const Vec3d at_wall{3, 2, 2};
  EXPECT_NEAR(irradiance_at(grid, at_wall, {1, 0, 0}).x, 0.5, 1e-6);
  CellCorners open;
  open.room.fill(0xff);
  grid.cells.assign(kLattice.cell_count(), open);
  CellCorners& cell = grid.cells[kLattice.cell_index(place_in(kLattice, at_wall).cell)];
  cell.surface[1].below.bits = 0b01010101;  // normals to -x see the corners of lower x
  cell.surface[0].below.bits = 0b10101010;
  EXPECT_FLOAT_EQ(irradiance_at(grid, at_wall, {1, 0, 0}).x, 0);
  grid.parts[0].swap(grid.parts[1]);  // now what -y reads is -f / 2; +y reads it
  cell.surface[2].below.bits = 0b01010101;
  EXPECT_FLOAT_EQ(irradiance_at(grid, at_wall, {0, 1, 0}).x, 1);
  constexpr std::uint8_t kAcrossX = 40;  // m = (1, 0, 0)
  cell.surface[2] = {kAcrossX, 128, {CornerSet::kOwnCell, 0b01010101}, {CornerSet::kOwnCell, 0b10101010}};
  EXPECT_FLOAT_EQ(irradiance_at(grid, {2.99, 2, 2}, {0, 1, 0}).x, 1);
  EXPECT_FLOAT_EQ(irradiance_at(grid, {3.01, 2, 2}, {0, 1, 0}).x, 0);
  cell.room[0] = 0;  // nothing counts: everything does
  EXPECT_NEAR(irradiance_at(grid, {2.9, 2, 2}, {0, 1, 0}, GridPlace::room).x, 0.6, 1e-6);
}

}  // namespace
}  // namespace kiln
