#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "core/prt/interreflection.h"
#include "tests/core/prt/lamp_scenes.h"

namespace kiln {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

Vec3f fixed_at(const Scene& scene, const TransferPoint& point, int samples, std::uint64_t seed = 0) {
  Threads threads(1);
  const Tracer tracer(scene, threads);
  return bake_fixed_direct(tracer, std::span(&point, 1), {.samples = samples, .seed = seed}, threads)[0];
}

TransferPoint floor_point(const Vec3f& position) { return {position, {0, 1, 0}, position, {0, 1, 0}}; }

TEST(FixedDirect, AFlatLampInTheOpenCostsFewRaysAndAnyOtherItsSamples) {
  Scene scene = testing::lamp_scene(0.2F, 1);
  Threads threads(1);
  const std::vector<TransferPoint> below{floor_point({0.1F, 0, 0})};
  const auto bake = [&](const FixedDirect& params) {
    TransferStats stats;
    const Tracer tracer(scene, threads);
    const float value = bake_fixed_direct(tracer, below, params, threads, &stats)[0].x;
    return std::pair(value, stats.rays);
  };
  const auto [flat, few] = bake({.samples = 256, .reach = 16, .tolerance = 1e-6F});
  scene.materials.back().alpha_mode = AlphaMode::mask;  // the same lamp, but not a flat one
  const auto [masked, all] = bake({.samples = 256});
  EXPECT_EQ(few, 64U);
  EXPECT_EQ(all, 256U + 64U);
  EXPECT_NEAR(masked / flat, 1, 0.01);  // 256 stratified samples of a smooth function
}

TEST(FixedDirect, BackOfASingleSidedLampIsDark) {
  Scene scene = testing::lamp_scene(0.2F, 1);
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
