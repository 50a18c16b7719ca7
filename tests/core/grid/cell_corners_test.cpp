// Light does not leak through walls thinner than a cell.

#include "core/grid/cell_corners.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/grid/bake_grid.h"
#include "core/meshless/radiosity.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kLit = 1, kDark = 2;  // parts; an empty scene has one of its own

/// Two rooms, one of them lit by all of its walls, and between them a gap of a hundredth. No light gets from one to the
/// other.
Scene two_rooms() {
  Scene scene = testing::empty_scene();
  const std::uint32_t lit = testing::add_part(scene, {0.5F, 0.5F, 0.5F});
  scene.materials.back().emission = {1, 1, 1};
  const std::uint32_t dark = testing::add_part(scene, {0.5F, 0.5F, 0.5F});
  testing::add_box(scene, {-0.5F, -0.3F, -0.3F}, {0.03F, 0.3F, 0.3F}, 4, true, lit);
  testing::add_box(scene, {0.04F, -0.3F, -0.3F}, {0.5F, 0.3F, 0.3F}, 4, true, dark);
  return scene;
}

double mean_light(const Scene& scene, const Grid& grid, std::uint32_t part, GridPlace kind) {
  double sum = 0, count = 0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.mesh.part[t] != part) continue;
    for (std::uint64_t i = 0; i < 16; ++i) {
      Random random(3, t, i);
      const float u = random.uniform() / 2, v = random.uniform() / 2;
      const auto [a, b, c] = scene.mesh.triangles[t];
      const auto& at = scene.mesh.position;
      const Vec3f p = at[a] * (1 - u - v) + at[b] * u + at[c] * v;
      sum += double{irradiance_at(grid, to_double(p), scene.mesh.normal[a], kind).x};
      count += 1;
    }
  }
  return sum / count;
}

TEST(CellCorners, KeepADarkRoomDarkBehindAWallThinnerThanACell) {
  const Scene scene = two_rooms();
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const RadiosityResult light = solve_radiosity(tracer, nullptr, {.points = {.wanted = 4000}}, threads);
  const BakedGrid baked = bake_grid({tracer, light.surface->faces(), light.surface.get(), nullptr},
                                    {.size = {9, 6, 6}, .rays = 256}, threads);
  const double lit = mean_light(scene, baked.grid, kLit, GridPlace::surface);
  EXPECT_NEAR(lit, 3.14159, 0.05 * 3.14159);  // a furnace of albedo 1/2: pi (1 / (1 - 1/2) - 1)
  EXPECT_LT(mean_light(scene, baked.grid, kDark, GridPlace::surface), 0.01 * lit);   // the promise of issue 5
  EXPECT_GT(mean_light(scene, baked.grid, kDark, GridPlace::anywhere), 0.05 * lit);  // what would leak without
}

TEST(CellCorners, AreThoseThatARayForEachLookUpFinds) {
  const Scene scene = testing::room_scene();
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const Box box = box_of(scene.mesh);
  const Lattice lattice = lattice_over(box.low, box.high, even_size(box.low, box.high, 12));
  const std::vector<Vec3f> stands = gather_places(lattice, scene, threads);
  std::uint64_t rays = 0;
  const std::vector<CellCorners> cells = find_cell_corners(tracer, lattice, stands, rays, threads);
  EXPECT_GT(rays, 0U);
  std::size_t same = 0, bits = 0;
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    for (std::uint64_t i = 0; i < 64; ++i) {
      Random random(5, t, i);
      const float u = random.uniform() / 2, v = random.uniform() / 2;
      const auto [a, b, c] = scene.mesh.triangles[t];
      const auto& at = scene.mesh.position;
      const Vec3f p = at[a] * (1 - u - v) + at[b] * u + at[c] * v, n = scene.mesh.normal[a];
      const CellPlace place = place_in(lattice, to_double(p));
      const CornerSet set = cells[lattice.cell_index(place.cell)].surface[nearest_direction(n)].at(place.fraction);
      const std::uint8_t stored = set.cell == CornerSet::kOwnCell ? set.bits : std::uint8_t{0};
      const std::uint8_t seen = corners_seen(tracer, lattice, stands, place, offset_origin(p, n));
      for (int k = 0; k < 8; ++k) same += (stored >> k & 1) == (seen >> k & 1) ? 1U : 0U;
      bits += 8;
    }
  }
  std::printf("agreement %.4f\n", static_cast<double>(same) / static_cast<double>(bits));
  EXPECT_GT(static_cast<double>(same) / static_cast<double>(bits), 0.95);  // they differ where an edge crosses a cell
}

TEST(CellCorners, CellsWithASurfaceAreThoseThatItPasses) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0.1F, -0.5F}, {0, 0, 1}, {1, 0, 0}, 1, 1);
  const Lattice lattice = lattice_over({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, {8, 8, 8});
  const std::vector<bool> crossed = cells_with_surface(scene.mesh, lattice);
  for (std::size_t i = 0; i < crossed.size(); ++i) {
    const auto [x, y, z] = lattice.cell(i);
    // y = .1 lies between the vertices 4 (.0625) and 5 (.1875).
    if (y == 4) {
      EXPECT_TRUE(crossed[i]);
    } else if (y < 3 || y > 5) {
      EXPECT_FALSE(crossed[i]);
    }
  }
}

}  // namespace
}  // namespace kiln
