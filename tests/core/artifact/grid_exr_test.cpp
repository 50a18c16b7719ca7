// grid.exr: what is written is read, and nothing else is.

#include "core/artifact/grid_exr.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace kiln {
namespace {

Grid random_grid(GridBlend blend, const std::array<int, 3>& size, float scale = 1) {
  Grid grid{.lattice = lattice_over({-0.5, -0.3, -0.1}, {0.5, 0.3, 0.1}, size), .blend = blend};
  grid.parts.assign(part_count(blend), std::vector<Vec3f>(grid.lattice.vertices()));
  for (std::size_t k = 0; k < grid.parts.size(); ++k) {
    const float by = blend == GridBlend::paper && k % 2 == 1 ? 1 : scale;
    for (std::size_t v = 0; v < grid.parts[k].size(); ++v) {
      Random random(1, k, v);
      const float x = random.uniform() - 0.5F, y = random.uniform() - 0.5F, z = random.uniform() - 0.5F;
      grid.parts[k][v] = Vec3f{x, y, z} * by;
    }
  }
  grid.cells.resize(grid.lattice.cell_count());
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    Random random(2, i);
    for (auto& bits : grid.cells[i].room) bits = static_cast<std::uint8_t>(random.next());
    const auto below = [&](int limit) { return static_cast<std::uint8_t>(random.next() % std::uint64_t(limit)); };
    for (CornerCut& side : grid.cells[i].surface) {
      side = {below(CornerCut::kDirectionsOfPlanes),
              below(256),
              {below(CornerSet::kCells), below(256)},
              {below(CornerSet::kCells), below(256)}};
    }
  }
  return grid;
}

const Frame kFrame{{1e7, -3, 0.25}, 12.5};

TEST(GridExr, ReadsBackWhatWasWrittenToTheHalf) {
  for (const GridBlend blend : {GridBlend::exact, GridBlend::paper}) {
    for (const float scale : {1e-8F, 1.0F, 1e8F}) {
      const Grid grid = random_grid(blend, {5, 3, 2}, scale);
      const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(read->blend, blend);
      EXPECT_EQ(read->lattice.size, grid.lattice.size);
      EXPECT_EQ(read->cells, grid.cells);
      EXPECT_EQ(read->lattice.origin, kFrame.to_world(grid.lattice.origin));  // 17 digits: the same doubles
      EXPECT_EQ(read->lattice.spacing, grid.lattice.spacing * kFrame.scale);
      for (std::size_t k = 0; k < grid.parts.size(); ++k) {
        for (std::size_t v = 0; v < grid.parts[k].size(); ++v) {
          for (std::size_t c = 0; c < 3; ++c) {
            const float truth = grid.parts[k][v][c];
            ASSERT_NEAR(read->parts[k][v][c], truth, std::abs(truth) * 0x1p-11F + 1e-9F * scale);
          }
        }
      }
    }
  }
}

TEST(GridExr, LightOfAllSizesIsNeverInfiniteNorSilentlyZero) {
  Grid grid = random_grid(GridBlend::exact, {2, 1, 1});
  grid.parts[0][0] = {1e8F, 1e-8F, -1e-8F};
  const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
  ASSERT_TRUE(read);
  EXPECT_NEAR(read->parts[0][0].x, 1e8F, 1e8F * 0x1p-11F);
  EXPECT_GT(read->parts[0][0].y, 0);
  EXPECT_LT(read->parts[0][0].y, 1e-10F * 1e8F);  // 2^-24 of what half floats can hold
  EXPECT_LT(read->parts[0][0].z, 0);
}

TEST(GridExr, SameBytesForTheSameGrid) {
  const Grid grid = random_grid(GridBlend::exact, {4, 4, 4});
  EXPECT_EQ(write_grid_exr(grid, kFrame, "{}"), write_grid_exr(grid, kFrame, "{}"));
}

TEST(GridExr, CornersThatCannotBeAreRefusedWithTheirPart) {
  const auto fault_of = [](const CornerCut& cut) {
    Grid grid = random_grid(GridBlend::exact, {3, 2, 2});
    grid.cells[1].surface[2] = cut;
    const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
    return read ? std::string() : read.error().message;
  };
  EXPECT_EQ(fault_of({242, 255, {26, 255}, {26, 255}}), "");
  EXPECT_EQ(fault_of({243, 1, {}, {}}), "Part corners.py must hold whole numbers below 243.");
  EXPECT_EQ(fault_of({0, 1, {27, 1}, {}}), "Part corners.cells.y must hold whole numbers below 27.");
}

TEST(GridExr, OneVertexIsAGrid) {
  const Grid grid = random_grid(GridBlend::exact, {1, 1, 1});
  const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->cells.size(), 1U);
}

TEST(GridExr, DamagedFilesAreRefusedOrReadAndNeverMore) {
  const Bytes good = write_grid_exr(random_grid(GridBlend::exact, {4, 3, 2}), kFrame, "{}");
  std::size_t refused = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    Random random(9, i);
    Bytes bad = good;
    if (i % 4 == 0) bad.resize(random.next() % bad.size());
    for (int k = 0; k < 4 && !bad.empty(); ++k) bad[random.next() % std::min<std::size_t>(bad.size(), 4096)] ^= 0x41;
    const auto read = read_grid_exr(bad, "grid.exr");
    if (!read) ++refused;
    if (read) {
      EXPECT_EQ(read->parts.size(), 9U);
    }
  }
  EXPECT_GT(refused, 200U);
}

}  // namespace
}  // namespace kiln
