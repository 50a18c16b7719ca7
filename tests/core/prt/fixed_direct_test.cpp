#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/prt/interreflection.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

Vec3f fixed_at(const Scene& scene, const TransferPoint& point, int samples, std::uint64_t seed = 0) {
  Threads threads(1);
  const Tracer tracer(scene, threads);
  return bake_fixed_direct(tracer, std::span(&point, 1), {.samples = samples, .seed = seed}, threads)[0];
}

TransferPoint floor_point(const Vec3f& position) { return {position, {0, 1, 0}, position, {0, 1, 0}}; }

// A floor at y = 0 and a square lamp of half side 0.25 overhead that faces down.
Scene lamp_scene(float height, float radiance) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  const std::uint32_t lamp = testing::add_part(scene, {0, 0, 0});
  scene.materials.back().emission = {radiance, radiance / 2, 0};
  testing::add_grid(scene, {-0.25F, height, -0.25F}, {0.5F, 0, 0}, {0, 0, 0.5F}, 1, 1, lamp);
  return scene;
}

double corner_factor(double a, double b, double c) {
  const double x = a / c, y = b / c;
  return (x / std::sqrt(1 + x * x) * std::atan(y / std::sqrt(1 + x * x)) +
          y / std::sqrt(1 + y * y) * std::atan(x / std::sqrt(1 + y * y))) /
         (2 * std::numbers::pi);
}

TEST(FixedDirect, PointUnderALampReceivesItsFormFactor) {
  for (const float height : {0.3F, 0.1F, 0.01F, 0.001F}) {  // down to nearly touching
    const Vec3f value = fixed_at(lamp_scene(height, 4), floor_point({0, 0, 0}), 4096);
    const double expected = 4 * 4 * corner_factor(0.25, 0.25, height);
    EXPECT_NEAR(value.x / expected, 1, 0.01) << height;  // 1024 cosine rays at worst: 0.3 / 1024^0.5
    EXPECT_NEAR(value.y, value.x / 2, 1e-5F * value.x);
    EXPECT_EQ(value.z, 0.0F);
  }
}

TEST(FixedDirect, TheMeanOfManySmallRunsHasNoBias) {
  const Scene scene = lamp_scene(0.05F, 1);
  double sum = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    sum += fixed_at(scene, floor_point({0.2F, 0, 0.1F}), 8, static_cast<std::uint64_t>(run)).x;
  }
  const double expected = corner_factor(0.45, 0.35, 0.05) + corner_factor(0.05, 0.35, 0.05) +
                          corner_factor(0.45, 0.15, 0.05) + corner_factor(0.05, 0.15, 0.05);
  EXPECT_NEAR(sum / kRuns, expected, 0.02 * expected);  // standard error: about 0.15 / sqrt(400)
}

/// Where samples agree they are all that is taken, with the value of as many; near the lamp's edge more are, and the
/// error falls.
TEST(FixedDirect, OnlyPointsWithALargeErrorTakeMoreRays) {
  const Scene scene = lamp_scene(0.01F, 1);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const auto bake = [&](const std::vector<TransferPoint>& points, const FixedDirect& params, std::uint64_t* rays) {
    TransferStats stats;
    const std::vector<Vec3f> out = bake_fixed_direct(tracer, points, params, threads, &stats);
    if (rays != nullptr) *rays = stats.rays;
    return out;
  };
  constexpr std::uint64_t kOfOnePoint = 64 + 16;
  std::uint64_t rays = 0;
  const std::vector<TransferPoint> far{floor_point({0.45F, 0, 0.45F})};
  const FixedDirect plain{.samples = 64, .seed = 3},
      adaptive{.samples = 64, .seed = 3, .reach = 16, .tolerance = 0.01F};
  const std::vector<Vec3f> once = bake(far, plain, nullptr), again = bake(far, adaptive, &rays);
  EXPECT_EQ(rays, kOfOnePoint);
  EXPECT_NEAR(again[0].x, once[0].x, 1e-6F);  // the same samples, summed in two parts

  std::vector<TransferPoint> edge;
  for (int i = 0; i < 64; ++i) edge.push_back(floor_point({0.25F, 0, -0.2F + 0.006F * static_cast<float>(i)}));
  const std::vector<Vec3f> truth = bake(edge, {.samples = 16384, .seed = 9}, nullptr);
  const auto squared_error = [&](const std::vector<Vec3f>& values) {
    double sum = 0;
    for (std::size_t i = 0; i < edge.size(); ++i) sum += std::pow(values[i].x - truth[i].x, 2);
    return sum;
  };
  const double before = squared_error(bake(edge, plain, nullptr)), after = squared_error(bake(edge, adaptive, &rays));
  EXPECT_GT(rays, 2 * kOfOnePoint * edge.size());
  EXPECT_LT(after, before / 4);  // half the error: four times the samples, of independent ones
}

TEST(FixedDirect, BackOfASingleSidedLampIsDark) {
  Scene scene = lamp_scene(0.2F, 1);
  const TransferPoint above{{0, 0.4F, 0}, {0, -1, 0}, {0, 0.4F, 0}, {0, -1, 0}};
  EXPECT_EQ(fixed_at(scene, above, 64).x, 0.0F);
  scene.materials.back().double_sided = true;
  EXPECT_GT(fixed_at(scene, above, 64).x, 0.1F);
}

TEST(FixedDirect, PointLightFallsOffWithTheSquareOfDistance) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  scene.lights.push_back({.type = LightType::point, .intensity = {2, 1, 0.5F}, .position = {0, 0.4F, 0}});
  const Vec3f below = fixed_at(scene, floor_point({0, 0, 0}), 1);
  // The origin is lifted by 2e-6 of the cube: 1e-5 of the distance.
  EXPECT_NEAR(below.x, 2 / (0.16F * kPi), 1e-4F);
  const Vec3f beside = fixed_at(scene, floor_point({0.3F, 0, 0}), 1);  // distance 0.5, cosine 0.8
  EXPECT_NEAR(beside.z, 0.5F * 0.8F / (0.25F * kPi), 1e-4F);
}

TEST(FixedDirect, DirectionalLightFollowsTheCosineAndItsShadow) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  scene.lights.push_back({.type = LightType::directional, .intensity = {3, 3, 3}, .direction = {0.6F, -0.8F, 0}});
  EXPECT_NEAR(fixed_at(scene, floor_point({0.1F, 0, 0}), 1).x, 3 * 0.8F / kPi, 1e-6F);
  testing::add_grid(scene, {-0.3F, 0.2F, 0.1F}, {0.2F, 0, 0}, {0, 0, -0.2F}, 1, 1);
  EXPECT_EQ(fixed_at(scene, floor_point({-0.05F, 0, 0}), 1).x, 0.0F);  // 0.15 downwind of the plate's centre
}

TEST(FixedDirect, ASceneWithoutLampsIsDarkAndCostsNoRay) {
  const Scene scene = testing::room_scene();
  Threads threads(1);
  const Tracer tracer(scene, threads);
  TransferStats stats;
  for (const Vec3f& x : bake_fixed_direct(tracer, vertex_points(scene.mesh), {}, threads, &stats)) {
    EXPECT_EQ(x, (Vec3f{}));
  }
  EXPECT_EQ(stats.rays, 0U);
}

}  // namespace
}  // namespace kiln
