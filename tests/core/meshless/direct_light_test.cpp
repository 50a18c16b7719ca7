// Direct light against closed forms and against the estimators it replaces.

#include "core/meshless/direct_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/prt/interreflection.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/trace/reference.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

/// A part that shines with this radiance and reflects nothing.
std::uint32_t add_lamp_part(Scene& scene, const Vec3f& radiance, bool double_sided = false) {
  const std::uint32_t part = testing::add_part(scene, {0, 0, 0}, double_sided);
  scene.materials.back().emission = radiance;
  return part;
}

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
  const std::uint32_t lamp = add_lamp_part(scene, {1, 2, 3});
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
    testing::add_grid(scene, {-0.5F, 0, -0.5F}, {1, 0, 0}, {0, 0, 1}, 2, 2, add_lamp_part(scene, {1, 1, 1}, both));
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
  testing::add_sphere(round, {}, 0.3F, 8, add_lamp_part(round, {1, 1, 1}));
  Threads threads(1);
  EXPECT_FALSE(FlatLamps::find(Tracer(round, threads)));
  Scene twice = testing::empty_scene();
  const std::uint32_t part = add_lamp_part(twice, {1, 1, 1});
  for (int i = 0; i < 2; ++i) testing::add_grid(twice, {-0.5F, 0, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1, 1, part);
  EXPECT_FALSE(FlatLamps::find(Tracer(twice, threads)));  // its outline would count twice
}

TEST(DirectLight, InAClosedBoxOfLampsIsTheirRadianceEverywhere) {
  // Every wall has radiance 1, so irradiance / pi is 1 at any place and for any normal; also at the very edges, where
  // horizons cut lamps that touch. Rays that slip through a seam and float rounding are left.
  Scene scene = testing::empty_scene();
  testing::add_box(scene, {-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}, 3, true, add_lamp_part(scene, {1, 1, 1}));
  Threads threads(1);
  const Tracer tracer(scene, threads);
  ASSERT_TRUE(FlatLamps::find(tracer));
  const DirectLight light(tracer, nullptr, {});
  std::uint64_t rays = 0;
  for (const TransferPoint& p : vertex_points(scene.mesh)) {
    EXPECT_NEAR(light.at({ray_origin(p), p.normal}, point_key(p), rays).x, 1, 2e-3);
  }
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random r(3, i);
    const Vec3f x{r.uniform() * 0.9F - 0.45F, r.uniform() * 0.9F - 0.45F, r.uniform() * 0.9F - 0.45F};
    const Vec3f n = to_float(uniform_sphere({r.uniform_double(), 0.1}));
    EXPECT_NEAR(light.at({x, n}, i, rays).x, 1, 1e-3);  // a sliver above the horizon may hold no point
  }
}

TEST(DirectLight, OfLampsAgreesWithBakeFixedDirect) {
  // A blocker half covers the lamp; the other estimator takes 16384 rays, so its noise is .001 and less.
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 6, 6);
  testing::add_grid(scene, {-0.15F, 0.5F, -0.15F}, {0.3F, 0, 0}, {0, 0, 0.3F}, 4, 4, add_lamp_part(scene, {5, 4, 3}));
  testing::add_grid(scene, {-0.1F, 0.2F, -0.2F}, {0.4F, 0, 0}, {0, 0, 0.3F}, 1, 1);
  scene.lights.push_back({.type = LightType::point, .intensity = {0.1F, 0.1F, 0.1F}, .position = {0.3F, 0.4F, 0}});
  Threads threads(2);
  const Tracer tracer(scene, threads);
  std::vector<TransferPoint> points = vertex_points(scene.mesh);
  points.resize(49);  // the floor
  const std::vector<Vec3f> truth = bake_fixed_direct(tracer, points, {.samples = 16384}, threads);
  const DirectLight light(tracer, nullptr, {});
  std::uint64_t rays = 0;
  double error = 0, mean = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f x = light.at({ray_origin(points[i]), points[i].normal}, point_key(points[i]), rays);
    error += std::pow(x.y - truth[i].y, 2) / 49, mean += truth[i].y / 49;
  }
  // Half a lamp hidden at 128 strata: the border cells, about 20 of them, are left to chance: .5 sqrt(20) / 128 = .017
  // at each such point.
  EXPECT_LT(std::sqrt(error) / mean, 0.012);
}

TEST(DirectLight, OfASkyAgreesWithTheReference) {
  Scene scene = testing::column_scene();
  Threads threads(2);
  const Tracer tracer(scene, threads);
  std::vector<TransferPoint> points = vertex_points(scene.mesh);
  points.resize(100);
  for (const Environment& sky : {constant_sky({1, 1, 1}), clear_sky_with_sun()}) {
    std::vector<ReferencePoint> places;
    for (const TransferPoint& p : points) places.push_back({ray_origin(p), p.normal, p.face_normal});
    const ReferenceResult truth =
        trace_reference(tracer, places, {.environments = {sky}}, {.samples = 4096, .bounces = 0}, threads);
    const DirectLight light(tracer, &sky, {.sky = 1024});
    std::uint64_t rays = 0;
    double error = 0, mean = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = light.at({ray_origin(points[i]), points[i].normal}, i, rays).x;
      error += std::pow(x - truth.value[i].x, 2) / 100, mean += truth.value[i].x / 100;
    }
    // Stratified visibility at 1024 rays: .01 at a point (anchors.md), and .005 of the truth's own 4096.
    EXPECT_LT(std::sqrt(error) / mean, 0.015) << sky.name;
  }
}

TEST(DirectLight, IsNothingInTheDark) {
  const Scene scene = testing::room_scene();
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const DirectLight light(tracer, nullptr, {});
  std::uint64_t rays = 0;
  EXPECT_TRUE(light.none());
  EXPECT_EQ(light.at({{0, 0, 0}, {0, 1, 0}}, 1, rays), Vec3f{});
  EXPECT_EQ(rays, 0U);
}

}  // namespace
}  // namespace kiln
