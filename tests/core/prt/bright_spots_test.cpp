#include "core/prt/bright_spots.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/prt/interreflection.h"
#include "core/trace/reference.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

/// A closed room of 48 x 48 quads a wall.
Scene room(const Light& lamp, bool double_sided = false, bool inside_out = false) {
  Scene scene = testing::empty_scene();
  const std::uint32_t part = testing::add_part(scene, {0.5F, 0.5F, 0.5F}, double_sided);
  testing::add_box(scene, {-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}, 48, !inside_out, part);
  scene.lights.push_back(lamp);
  return scene;
}

Light lamp_at(const Vec3f& position) {
  Light light;
  light.position = position;
  light.intensity = {1, 2, 1};
  return light;
}

Light spot_at(const Vec3f& position, const Vec3f& direction) {
  Light light = lamp_at(position);
  light.type = LightType::spot;
  light.direction = direction;
  light.inner_cone = light.outer_cone = 0.7F;
  return light;
}

struct Reflected {
  std::vector<float> once;  // at the ceiling's inner vertices, green: of one reflection
  std::vector<float> expected;
  double mean = 0;
};

/// Light of one reflection at ceiling vertices, and the reference there.
Reflected one_reflection(const Scene& scene, int samples) {
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  const std::vector<Vec3f> lamps = bake_fixed_direct(tracer, points, {}, threads);
  const Transfer t = bake_interreflection(tracer, scene.mesh, std::vector<float>(points.size(), 0.0F), lamps,
                                          {.order = 1, .bounces = 1, .samples = samples}, threads);
  Reflected out;
  std::vector<ReferencePoint> places;
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3f& p = points[v].position;
    if (v % 16 != 0 || p.y < 0.49F || std::abs(p.x) > 0.45F || std::abs(p.z) > 0.45F) continue;
    out.once.push_back(t.at(v, 1)[1] - lamps[v].y);
    places.push_back({p, points[v].normal, points[v].normal});
  }
  const ReferenceResult truth =
      trace_reference(tracer, places, {.scene_lights = true}, {.samples = 4096, .bounces = 1, .from = 1}, threads);
  for (const Vec3d& x : truth.value) {
    out.expected.push_back(static_cast<float>(x.y));
    out.mean += x.y / static_cast<double>(truth.value.size());
  }
  return out;
}

double relrmse(const Reflected& r) {
  double sum = 0;
  for (std::size_t i = 0; i < r.once.size(); ++i) sum += std::pow(r.once[i] - r.expected[i], 2);
  return std::sqrt(sum / static_cast<double>(r.once.size())) / r.mean;
}

double bias(const Reflected& r) {
  double sum = 0;
  for (std::size_t i = 0; i < r.once.size(); ++i) sum += r.once[i] - r.expected[i];
  return sum / static_cast<double>(r.once.size()) / r.mean;
}

/// A hundredth above the floor: the spot holds half of the light in a thousandth of the area, and quads are twice as
/// wide as it is high. Gathering rays alone have an error of .78 here and .39 below, in these very tests without looks;
/// with 256 of them the rest of the light leaves about .02.
TEST(BrightSpots, SpotOfALampAboveTheFloorReachesTheCeiling) {
  for (const Light& lamp : {lamp_at({0.03F, -0.49F, 0.05F}), spot_at({0.03F, -0.49F, 0.05F}, {0, -1, 0})}) {
    const Reflected r = one_reflection(room(lamp), 256);
    EXPECT_LT(relrmse(r), 0.05);
    EXPECT_NEAR(bias(r), 0, 0.02);
  }
}

/// The same room seen from behind: faces that no vertex stands for.
TEST(BrightSpots, BacksOfDoubleSidedFacesHaveSpotsToo) {
  Scene scene = room(lamp_at({0.03F, -0.49F, 0.05F}), true, true);
  const std::uint32_t part = testing::add_part(scene, {0.5F, 0.5F, 0.5F});
  testing::add_grid(scene, {-0.1F, 0.3F, -0.1F}, {0.2F, 0, 0}, {0, 0, 0.2F}, 2, 2, part);
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  const std::vector<Vec3f> lamps = bake_fixed_direct(tracer, points, {}, threads);
  const Transfer t = bake_interreflection(tracer, scene.mesh, std::vector<float>(points.size(), 0.0F), lamps,
                                          {.order = 1, .bounces = 1, .samples = 1024}, threads);
  std::vector<ReferencePoint> places;
  Reflected r;
  for (std::size_t v = points.size() - 9; v < points.size(); ++v) {
    places.push_back({points[v].position, points[v].normal, points[v].normal});
    r.once.push_back(t.at(v, 1)[1] - lamps[v].y);
  }
  const ReferenceResult truth =
      trace_reference(tracer, places, {.scene_lights = true}, {.samples = 16384, .bounces = 1, .from = 1}, threads);
  for (const Vec3d& x : truth.value) {
    r.expected.push_back(static_cast<float>(x.y));
    r.mean += x.y / 9;
  }
  ASSERT_GT(r.mean, 0);
  EXPECT_LT(relrmse(r), 0.05);
  EXPECT_NEAR(bias(r), 0, 0.02);
}

/// In the middle of a room a lamp lights nothing four times the mean.
TEST(BrightSpots, LampInMidRoomHasNone) {
  const Scene scene = room(lamp_at({0, 0, 0}));
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  double mean = 0;
  for (const Vec3f& x : bake_fixed_direct(tracer, points, {}, threads))
    mean += (x.x + x.y + x.z) / (3.0 * static_cast<double>(points.size()));
  EXPECT_TRUE(BrightSpots(tracer, mean, 1).empty());
  EXPECT_FALSE(BrightSpots(tracer, 0, 1).empty());  // no vertex knows of its light
}

}  // namespace
}  // namespace kiln
