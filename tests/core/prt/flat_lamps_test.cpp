#include "core/prt/flat_lamps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/core/prt/lamp_scenes.h"

namespace kiln {
namespace {

const std::vector<Vec3d> kSquare = {{-0.5, 1, -0.5}, {0.5, 1, -0.5}, {0.5, 1, 0.5}, {-0.5, 1, 0.5}};

TEST(LoopFormFactor, OfASquareAboveItsCentreIsTheTextbookOne) {
  // Four times the corner formula of a rectangle a x b at distance c with X = a / c, Y = b / c (Howell, B-4).
  const double x = 0.5, r = std::sqrt(1 + x * x);
  const double corner = 1 / (2 * std::numbers::pi) * 2 * (x / r * std::atan(x / r));
  EXPECT_NEAR(std::abs(loop_form_factor(kSquare, {}, {0, 1, 0})), 4 * corner, 1e-12);
}

TEST(LoopFormFactor, OfAHorizonThatCutsIsThatOfThePartAbove) {
  // Normal along x: the half of the square with x > 0 counts.
  const std::vector<Vec3d> half = {{0, 1, -0.5}, {0.5, 1, -0.5}, {0.5, 1, 0.5}, {0, 1, 0.5}};
  const Vec3d n{1, 0, 0};
  EXPECT_GT(std::abs(loop_form_factor(half, {}, n)), 0.02);
  EXPECT_NEAR(loop_form_factor(kSquare, {}, n), loop_form_factor(half, {}, n), 1e-12);
  for (std::size_t turn = 1; turn < 4; ++turn) {  // wherever the loop starts
    std::vector<Vec3d> turned = kSquare;
    std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(turn), turned.end());
    EXPECT_NEAR(loop_form_factor(turned, {}, n), loop_form_factor(half, {}, n), 1e-12);
  }
  EXPECT_EQ(loop_form_factor(kSquare, {}, {0, -1, 0}), 0);
}

TEST(FlatLamps, DropInnerEdgesAndSeeTwoSquaresWithTheirFormFactor) {
  // Two facing unit squares a unit apart: F = .199825 (closed form, Howell C-11), the mean over the receiver.
  Scene scene = testing::empty_scene();
  const std::uint32_t lamp = testing::add_lamp_part(scene, {1, 2, 3});
  testing::add_grid(scene, {-0.5F, 0.5F, -0.5F}, {1, 0, 0}, {0, 0, 1}, 7, 5, lamp);  // looks down
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const auto flat = FlatLamps::find(tracer);
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->count(), 1U);
  std::uint64_t rays = 0;
  Vec3d sum;
  constexpr int kSide = 64;  // midpoint rule: error of order 1 / 64^2 = 2e-4 of the curvature, 1e-5 here
  for (int i = 0; i < kSide * kSide; ++i) {
    const float x = (static_cast<float>(i % kSide) + 0.5F) / kSide - 0.5F,
                z = (static_cast<float>(i / kSide) + 0.5F) / kSide - 0.5F;
    sum += to_double(flat->light_at({{x, -0.5F, z}, {0, 1, 0}}, {.few = 16, .many = 64}, 1, rays)) / (kSide * kSide);
  }
  EXPECT_NEAR(sum.x, 0.199825, 3e-5);
  EXPECT_NEAR(sum.y, 2 * 0.199825, 6e-5);
  EXPECT_NEAR(sum.z, 3 * 0.199825, 9e-5);
  EXPECT_EQ(rays, 16U * kSide * kSide);  // nothing stands between: few rays are enough
}

TEST(FlatLamps, HaveNoLightBehindUnlessTheyShineBothWays) {
  for (const bool both : {false, true}) {
    Scene scene = testing::empty_scene();
    testing::add_grid(scene, {-0.5F, 0, -0.5F}, {1, 0, 0}, {0, 0, 1}, 2, 2,
                      testing::add_lamp_part(scene, {1, 1, 1}, both));
    Threads threads(1);
    const Tracer tracer(scene, threads);
    std::uint64_t rays = 0;
    const float above = FlatLamps::find(tracer)->light_at({{0, 0.3F, 0}, {0, -1, 0}}, {}, 1, rays).x;
    const float below = FlatLamps::find(tracer)->light_at({{0, -0.3F, 0}, {0, 1, 0}}, {}, 1, rays).x;
    EXPECT_GT(below, 0.5F);
    EXPECT_EQ(above > 0, both);
    if (both) {
      EXPECT_FLOAT_EQ(above, below);
    }
  }
}

TEST(FlatLamps, RefuseWhatIsNotFlat) {
  Scene round = testing::empty_scene();
  testing::add_sphere(round, {}, 0.3F, 8, testing::add_lamp_part(round, {1, 1, 1}));
  Threads threads(1);
  EXPECT_FALSE(FlatLamps::find(Tracer(round, threads)));
  Scene twice = testing::empty_scene();
  const std::uint32_t part = testing::add_lamp_part(twice, {1, 1, 1});
  for (int i = 0; i < 2; ++i) testing::add_grid(twice, {-0.5F, 0, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1, 1, part);
  EXPECT_FALSE(FlatLamps::find(Tracer(twice, threads)));  // its outline would count twice
}

/// Where a blocker hides a part of a lamp rounds go on until they agree; the error falls with the tolerance.
TEST(FlatLamps, TakeMoreRaysWhereALampIsPartlyHidden) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.25F, 0.5F, -0.25F}, {0.5F, 0, 0}, {0, 0, 0.5F}, 1, 1,
                    testing::add_lamp_part(scene, {1, 1, 1}));
  testing::add_grid(scene, {-0.1F, 0.2F, -0.3F}, {0.5F, 0, 0}, {0, 0, 0.6F}, 1, 1);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const auto flat = FlatLamps::find(tracer);
  ASSERT_TRUE(flat);
  const Lamps lamps(tracer);
  std::uint64_t unused = 0, loose = 0, tight = 0;
  double of_loose = 0, of_tight = 0, mean = 0;
  constexpr int kPoints = 40;
  for (int i = 0; i < kPoints; ++i) {  // across the penumbra
    const Receiver at{{-0.2F + 0.004F * static_cast<float>(i), 0, 0.05F}, {0, 1, 0}};
    const auto seed = static_cast<std::uint64_t>(i);
    const float truth = lamps.emitted(at, {.samples = 16384}, seed, unused).x;
    mean += truth / kPoints;
    of_loose += std::pow(flat->light_at(at, {32, 4096, 0.01F}, seed, loose).x - truth, 2) / kPoints;
    of_tight += std::pow(flat->light_at(at, {32, 4096, 0.001F}, seed, tight).x - truth, 2) / kPoints;
  }
  EXPECT_LT(std::sqrt(of_loose), 2 * 0.01);  // rounds agree by chance here and there
  EXPECT_LT(std::sqrt(of_tight), 2 * 0.001);
  EXPECT_LT(2 * loose, tight);
  EXPECT_GT(mean, 0.05);  // of .5 in the open
}

}  // namespace
}  // namespace kiln
