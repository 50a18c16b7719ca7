// grid.exr: what is written is read, and nothing else is.

#include "core/artifact/grid_exr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/base/random.h"

namespace kiln {
namespace {

Grid random_grid_on(const Lattice& lattice, GridBlend blend, float scale) {
  Grid grid{.lattice = lattice, .blend = blend};
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

Grid random_grid(GridBlend blend, const std::array<int, 3>& size, float scale = 1) {
  return random_grid_on(lattice_over({-0.5, -0.3, -0.1}, {0.5, 0.3, 0.1}, size), blend, scale);
}

/// Two finer lattices, of two bricks and of one at the far end.
Grid random_bricks(GridBlend blend) {
  Grid grid = random_grid(blend, {6, 5, 4});
  grid.finer.push_back(random_grid_on(in_bricks(finer_lattice(grid.lattice, 0), {1, 4}), blend, 1));
  const auto [x, y, z] = blocks_along(finer_lattice(grid.lattice, 1));
  grid.finer.push_back(
      random_grid_on(in_bricks(finer_lattice(grid.lattice, 1), {static_cast<std::uint32_t>(x * y * z - 1)}), blend, 2));
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

TEST(GridExr, BricksComeBackInTheirPlaces) {
  for (const GridBlend blend : {GridBlend::exact, GridBlend::paper}) {
    const Grid grid = random_bricks(blend);
    const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->finer.size(), 2U);
    for (std::size_t k = 0; k < 2; ++k) {
      const Grid &written = grid.finer[k], &back = read->finer[k];
      EXPECT_EQ(back.lattice.size, written.lattice.size);
      EXPECT_EQ(back.lattice.bricks.block, written.lattice.bricks.block);
      EXPECT_EQ(back.lattice.bricks.place, written.lattice.bricks.place);
      EXPECT_EQ(back.cells, written.cells);
      for (std::size_t p = 0; p < written.parts.size(); ++p) {
        for (std::size_t v = 0; v < written.parts[p].size(); ++v)  // of values up to 2, and of directions
          ASSERT_NEAR(back.parts[p][v].x, written.parts[p][v].x, 0x1p-10);
      }
    }
    // The same light in the world as in the unit cube.
    for (std::uint64_t i = 0; i < 300; ++i) {
      Random random(3, i);
      const Vec3d p{random.uniform_double() - 0.5, 0.6 * random.uniform_double() - 0.3,
                    0.2 * random.uniform_double() - 0.1};
      const Vec3f a = irradiance_at(grid, p, {0, 0.6F, 0.8F}),
                  b = irradiance_at(*read, kFrame.to_world(p), {0, 0.6F, 0.8F});
      EXPECT_NEAR(a.x, b.x, 0.01) << i;  // halves of values around 1, and directions of near 0 in the paper's
    }
  }
}

TEST(GridExr, BricksThatAreNotInOrderAreRefused) {
  Grid grid = random_bricks(GridBlend::exact);
  std::swap(grid.finer[0].lattice.bricks.number[1], grid.finer[0].lattice.bricks.number[4]);
  const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "Part finer.1.bricks must number its bricks in their order.");
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

TEST(GridExr, TheVersionBeforeBricksIsReadToo) {
  const Grid grid = random_grid(GridBlend::exact, {4, 4, 4});
  Bytes file = write_grid_exr(grid, kFrame, "{}");
  const std::string name = "kiln.grid", word = std::string("string") + '\0' + '\1' + '\0' + '\0' + '\0' + '3';
  const auto version = [&](char written) {
    const auto at = std::ranges::search(file, name).begin();
    const auto value = std::ranges::search(std::span(at, file.end()), word).begin() + std::ssize(word) - 1;
    *value = static_cast<std::uint8_t>(written);
    return read_grid_exr(file, "grid.exr");
  };
  const auto before = version('2');
  ASSERT_TRUE(before) << before.error().message;
  EXPECT_EQ(before->cells, grid.cells);
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
  EXPECT_EQ(fault_of({0, 1, {28, 1}, {}}), "Part corners.cells.y must hold whole numbers below 28.");
}

TEST(GridExr, OneVertexIsAGrid) {
  const Grid grid = random_grid(GridBlend::exact, {1, 1, 1});
  const auto read = read_grid_exr(write_grid_exr(grid, kFrame, "{}"), "grid.exr");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->cells.size(), 1U);
}

TEST(GridExr, DamagedFilesAreRefusedOrReadAndNeverMore) {
  const std::array<Bytes, 2> whole{write_grid_exr(random_grid(GridBlend::exact, {4, 3, 2}), kFrame, "{}"),
                                   write_grid_exr(random_bricks(GridBlend::exact), kFrame, "{}")};
  std::size_t refused = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const Bytes& good = whole[i / 2 % 2];
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
