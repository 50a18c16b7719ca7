#include "core/trace/lamp_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/trace/reference.h"
#include "tests/core/trace/test_scenes.h"

namespace kiln {
namespace {

using test::add_material;
using test::add_quad;
using test::add_room;

constexpr double kPi = std::numbers::pi;

Light white_lamp(const Vec3f& position) {
  Light light;
  light.intensity = {1, 1, 1};
  light.position = position;
  return light;
}

Light white_spot(const Vec3f& position, float half_angle) {
  Light light = white_lamp(position);
  light.type = LightType::spot;
  light.direction = {0, -1, 0};
  light.inner_cone = light.outer_cone = half_angle;
  return light;
}

struct Mean {
  double value = 0, error = 0;  // one standard error, from the spread of the points
};

/// Mean red of independent points.
Mean mean_of(const std::vector<Vec3d>& values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const Vec3d& v : values) sum += v.x, squares += v.x * v.x;
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / n)};
}

Mean estimate(const Scene& scene, const std::vector<ReferencePoint>& points, const ReferenceLight& light,
              const ReferenceOptions& options) {
  Threads threads(2);
  return mean_of(trace_reference(Tracer(scene, threads), points, light, options, threads).value);
}

/// A lamp a ten-thousandth above a floor lights a spot that stands for a Lambertian source of half its power: no path
/// hits it by chance. Half a unit above, 2 rho I / pi / height^2; a height of 1e-4 takes a part of 2e-4 from it, the
/// floor's end as much.
TEST(LampLight, SpotOfALampThatNearlyTouchesTheFloorIsSeen) {
  const ReferencePoint ceiling{{0, 0.5F, 0}, {0, -1, 0}, {0, -1, 0}};
  for (const bool own : {false, true}) {
    Scene scene;
    add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {0.5F, 0.5F, 0.5F}));
    ReferenceLight light{.scene_lights = !own};
    (own ? light.lamps : scene.lights).push_back(white_lamp({0, 1e-4F, 0}));
    const Mean mean =
        estimate(scene, std::vector<ReferencePoint>(16, ceiling), light, {.samples = 1024, .bounces = 1, .from = 1});
    const double truth = 2 * 0.5 / (kPi * 0.25);
    EXPECT_NEAR(mean.value, truth, 4 * mean.error + 1e-3 * truth) << own;
    EXPECT_LT(mean.error, 0.01 * truth) << own;
  }
}

constexpr double kAlbedo = 0.5;

Scene grey_room() {
  Scene scene;
  const auto rho = static_cast<float>(kAlbedo);
  add_room(scene, 0.5F, add_material(scene, {rho, rho, rho}));
  return scene;
}

/// In a closed room of area 6 the light of all reflections is flux / (6 pi) rho / (1 - rho) in the mean, wherever the
/// lamp hangs.
void expect_conserved(const Scene& scene, const ReferenceLight& light, double flux, double spread = 0.02) {
  const Mean mean = estimate(scene, test::points_on(scene, 0, 12, 20'000), light, {.samples = 8, .from = 1});
  const double truth = flux / (6 * kPi) * kAlbedo / (1 - kAlbedo);
  EXPECT_NEAR(mean.value, truth, 4 * mean.error + 2e-3 * truth);  // what a lamp's own plate takes
  EXPECT_LT(mean.error, spread * truth);
}

TEST(LampLight, LampsNearAWallLoseNothing) {
  for (const Light& lamp : {white_lamp({0.1F, -0.499F, 0.2F}), white_lamp({0.47F, -0.48F, 0.2F}), white_lamp({}),
                            white_spot({0.1F, -0.499F, 0.2F}, 0.8F)}) {
    const double flux = lamp.type == LightType::spot ? 2 * kPi * (1 - std::cos(0.8)) : 4 * kPi;
    Scene scene = grey_room();
    expect_conserved(scene, {.lamps = {lamp}}, flux);
    scene.lights.push_back(lamp);
    expect_conserved(scene, {.scene_lights = true}, flux);
  }
}

/// A thousandth from one wall and two from another: spots light each other. What spread is left (.053) is that of the
/// points near the corner; with beams that are not reflected it was .19.
TEST(LampLight, LampInACornerLosesNothing) {
  Scene scene = grey_room();
  scene.lights.push_back(white_lamp({0.498F, -0.499F, 0.2F}));
  expect_conserved(scene, {.scene_lights = true}, 4 * kPi, 0.08);
}

TEST(LampLight, EmittersNearAWallLoseNothing) {
  for (const bool both : {false, true}) {
    Scene scene = grey_room();
    const auto rho = static_cast<float>(kAlbedo);
    const int glowing = add_material(scene, {rho, rho, rho}, {1000, 1000, 1000}, both);
    add_quad(scene, {0.1F, -0.45F, 0.2F}, {0.004F, 0, 0}, {0, 0, 0.004F}, glowing);  // looks down
    expect_conserved(scene, {.scene_lights = true}, kPi * 1000 * 1.6e-5 * (both ? 2 : 1));
  }
}

/// Lamps of many kinds at once share the beams; their light adds up.
TEST(LampLight, LightOfManyLampsIsTheSumOfEach) {
  Scene scene = grey_room();
  Light sun;
  sun.type = LightType::directional;
  sun.direction = {0.6F, -0.8F, 0};
  sun.intensity = {1, 1, 1};  // shut out
  scene.lights = {white_lamp({0.1F, -0.49F, 0.2F}), sun, white_spot({0, 0.4F, 0}, 0.5F)};
  const auto rho = static_cast<float>(kAlbedo);
  add_quad(scene, {-0.2F, 0.3F, 0.1F}, {0.02F, 0, 0}, {0, 0, 0.02F},
           add_material(scene, {rho, rho, rho}, {1000, 1000, 1000}));
  const double flux = 4 * kPi + 2 * kPi * (1 - std::cos(0.5)) + kPi * 0.4;
  expect_conserved(scene, {.scene_lights = true}, flux);
}

/// A face that is lit from behind shows none of it, from either side of the beam.
TEST(LampLight, BackOfASingleSidedFaceStaysBlack) {
  Scene scene;
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {0.5F, 0.5F, 0.5F}));
  scene.lights.push_back(white_lamp({0, 0.01F, 0}));
  const ReferencePoint below{{0.1F, -0.3F, 0}, {0, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(estimate(scene, {below}, {.scene_lights = true}, {.samples = 64}).value, 0);
  scene.materials[0].double_sided = true;  // then it is lit above and seen from below: still nothing
  EXPECT_EQ(estimate(scene, {below}, {.scene_lights = true}, {.samples = 64}).value, 0);
}

}  // namespace
}  // namespace kiln
