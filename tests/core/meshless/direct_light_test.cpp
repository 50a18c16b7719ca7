// Direct light against closed forms and against the estimators it replaces.

#include "core/meshless/direct_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/prt/interreflection.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/trace/reference.h"
#include "tests/core/prt/lamp_scenes.h"

namespace kiln {
namespace {

TEST(DirectLight, InAClosedBoxOfLampsIsTheirRadianceEverywhere) {
  // Every wall has radiance 1, so irradiance / pi is 1 at any place and for any normal; also at the very edges, where
  // horizons cut lamps that touch. Rays that slip through a seam and float rounding are left.
  Scene scene = testing::empty_scene();
  testing::add_box(scene, {-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}, 3, true, testing::add_lamp_part(scene, {1, 1, 1}));
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

TEST(DirectLight, OfLampsAgreesWithPointsAndRays) {
  // A blocker half covers the lamp; the other estimator takes 16384 rays, so its noise is .001 and less.
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 6, 6);
  testing::add_grid(scene, {-0.15F, 0.5F, -0.15F}, {0.3F, 0, 0}, {0, 0, 0.3F}, 4, 4,
                    testing::add_lamp_part(scene, {5, 4, 3}));
  testing::add_grid(scene, {-0.1F, 0.2F, -0.2F}, {0.4F, 0, 0}, {0, 0, 0.3F}, 1, 1);
  scene.lights.push_back({.type = LightType::point, .intensity = {0.1F, 0.1F, 0.1F}, .position = {0.3F, 0.4F, 0}});
  Threads threads(2);
  const Tracer tracer(scene, threads);
  std::vector<TransferPoint> points = vertex_points(scene.mesh);
  points.resize(49);  // the floor
  const Lamps lamps(tracer);
  const DirectLight light(tracer, nullptr, {});
  std::uint64_t rays = 0;
  double error = 0, mean = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Receiver at{ray_origin(points[i]), points[i].normal};
    const float truth = lamps.punctual(at).y + lamps.emitted(at, {.samples = 16384}, i, rays).y;
    error += std::pow(light.at(at, point_key(points[i]), rays).y - truth, 2) / 49, mean += truth / 49;
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
