#include "core/bake/level_switch.h"

#include <gtest/gtest.h>

#include "tests/core/lightfield/lit_models.h"

namespace kiln {
namespace {

constexpr int kSide = LevelPictures::kFinest;

/// The same picture for every eye.
template <class Colour>
LevelPictures drawn(const Colour& colour) {
  LevelPictures out;
  for (int eye = 0; eye < LevelPictures::kEyes; ++eye)
    for (int row = 0; row < kSide; ++row)
      for (int column = 0; column < kSide; ++column) {
        const float grey = colour(row, column);
        out.pixels.push_back({grey, grey, grey, 1});
      }
  return out;
}

TEST(LevelSwitch, CielabOfKnownColours) {
  // CIE 1976 of the primaries of sRGB, to the digits of its matrix.
  const auto expect = [](const Vec3d& rgb, const Vec3d& lab) { EXPECT_LT(length(cielab(rgb) - lab), 0.02); };
  expect({1, 1, 1}, {100, 0, 0});
  expect({0, 0, 0}, {0, 0, 0});
  expect({1, 0, 0}, {53.24, 80.09, 67.20});
  expect({0, 0, 1}, {32.30, 79.19, -107.86});
  expect({0.001, 0.001, 0.001}, {0.9033, 0, 0});  // the straight end of the curve: 24389 / 27 Y
}

TEST(LevelSwitch, PicturesThatAreTheSameMaySwitchAtAnySize) {
  const LevelPictures one = drawn([](int row, int) { return static_cast<float>(row) / kSide; });
  const LevelSwitch found = level_switch(one, one);
  EXPECT_EQ(found.pixels, kSide);
  EXPECT_EQ(found.difference, 0);
}

TEST(LevelSwitch, ADifferenceOfBrightnessIsSeenAtEverySize) {
  const LevelSwitch found = level_switch(drawn([](int, int) { return 0.3F; }), drawn([](int, int) { return 0.4F; }));
  EXPECT_EQ(found.pixels, 0);
  const Vec3d off = cielab({0.3, 0.3, 0.3}) - cielab({0.4, 0.4, 0.4});
  EXPECT_NEAR(found.difference, length(off), 1e-5);  // floats of the pictures
}

TEST(LevelSwitch, DetailOfFourPixelsIsSeenInPicturesOfAFourthAndNotOfASixthOfTheSize) {
  const LevelPictures squares =
      drawn([](int row, int column) { return (row / 4 + column / 4) % 2 == 0 ? 0.2F : 0.4F; });
  const LevelSwitch found = level_switch(squares, drawn([](int, int) { return 0.3F; }));
  EXPECT_EQ(found.pixels, kSide / 6);
  // Of six pixels four are even and two are left over: a ninth of the contrast, all over the picture.
  const Vec3d off = cielab({0.3, 0.3, 0.3}) - cielab({0.3 + 0.1 / 9, 0.3 + 0.1 / 9, 0.3 + 0.1 / 9});
  EXPECT_NEAR(found.difference, length(off), 0.05);  // L* is no straight line
}

BakedScene ball(std::uint32_t n) {
  LitMesh lit = testing::sphere(n, [](const Vec3f& p) { return Vec3f{0.3F, 0.3F, 0.3F} * (1 + p.y); });
  BakedScene out;
  out.scene.mesh = std::move(lit.mesh);
  out.scene.parts.resize(1), out.scene.materials.resize(1);
  out.field = std::move(lit.field);
  return out;
}

TEST(LevelSwitch, CoarserBallsMaySwitchAtSmallerSizesOnly) {
  Threads threads(2);
  const BakedScene finest = ball(48);
  LevelPictures before = level_pictures(finest, finest.scene.mesh, threads);
  int last = kSide;
  for (const std::uint32_t n : {24U, 6U, 3U, 2U, 1U}) {
    LevelPictures now = level_pictures(ball(n), finest.scene.mesh, threads);
    const LevelSwitch found = level_switch(before, now);
    EXPECT_LE(found.pixels, last) << n;
    std::printf("%u squares: %d pixels, %.2f\n", n, found.pixels, found.difference);
    EXPECT_TRUE(found.pixels == 0 || found.difference <= LevelSwitch::kVisible) << found.difference;
    last = found.pixels;
    before = std::move(now);
  }
  EXPECT_LT(last, kSide / 4);  // a cube in place of 24 squares that make a ball
}

}  // namespace
}  // namespace kiln
