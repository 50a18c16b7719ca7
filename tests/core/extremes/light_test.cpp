// Extreme light: none, sixteen decades of it, a sun a million times its sky, lamps that touch walls or are shut in.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "core/base/random.h"
#include "core/prt/interreflection.h"
#include "core/sphere/sampling.h"
#include "core/trace/reference.h"
#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/extremes/random_bake.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln::test {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<Vec3f> lamps_at(const Scene& scene, std::span<const TransferPoint> points, int samples) {
  Threads threads(1);
  const Tracer tracer(scene, threads);
  return bake_fixed_direct(tracer, points, {.samples = samples}, threads);
}

/// A square lamp of half side a that hangs at height c over (or under) the origin.
void add_lamp(Scene& scene, float a, float c, float radiance) {
  const std::uint32_t part = kiln::testing::add_part(scene, {0, 0, 0});
  scene.materials.back().emission = {radiance, radiance, radiance};
  if (c > 0) {
    kiln::testing::add_grid(scene, {-a, c, -a}, {2 * a, 0, 0}, {0, 0, 2 * a}, 1, 1, part);
  } else {
    kiln::testing::add_grid(scene, {-a, c, a}, {2 * a, 0, 0}, {0, 0, -2 * a}, 1, 1, part);
  }
}

/// Form factor from the origin to that lamp (Hamilton 1952): four times that of a corner.
double form_factor(double a, double c) {
  const double x = a / c, r = std::sqrt(1 + x * x);
  return 4 * (2 * x / r * std::atan(x / r)) / (2 * kPi);
}

TEST(ExtremeLight, SixteenDecadesInOneSceneAreEachRight) {
  // A lamp of 1e-8 over a sheet and one of 1e8 under it: neither shines through.
  Scene scene = kiln::testing::empty_scene();
  kiln::testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  add_lamp(scene, 0.25F, 0.2F, 1e-8F);
  add_lamp(scene, 0.25F, -0.2F, 1e8F);
  const TransferPoint above{{0, 0, 0}, {0, 1, 0}, {0, 0, 0}, {0, 1, 0}},
      below{{0, 0, 0}, {0, -1, 0}, {0, 0, 0}, {0, -1, 0}};
  const std::vector<Vec3f> light = lamps_at(scene, std::vector{above, below}, 4096);
  // The faint lamp is found by its 1024 cosine rays alone: stratified, 0.5 / 1024^0.75 = 3e-3 of 1; twice three of it.
  EXPECT_NEAR(light[0].x / 1e-8, form_factor(0.25, 0.2), 0.02);
  EXPECT_NEAR(light[1].x / 1e8, form_factor(0.25, 0.2), 0.01);
}

TEST(ExtremeLight, NoLightAtAllIsDarkAndNoFault) {
  Sample s;
  s.positions(cube_positions());
  s.indices(cube_indices());
  BakeInput input{
      .scene = {.name = "scene.glb", .main = s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1"))}};
  input.recipe = *parse_recipe(R"({"environment":{"constant":[0,0,0]},"steps":[{"do":"prt","order":2,"samples":16}]})");
  Threads threads(2);
  const auto output = bake(input, {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto baked = read_baked_glb(file_of(*output, "scene.glb"));
  ASSERT_TRUE(baked);
  for (const Vec3f& x : values_of(baked->transfer, baked->light.coefficients)) EXPECT_EQ(x, Vec3f{});
  EXPECT_EQ(baked->exposure, 1);
}

/// A sky of 1 with a sun of 1e6 in one texel of 2048 x 1024: 9.4e-6 sr times cos of its elevation, all in all.
struct SunnySky {
  Environment sky;
  Vec3d direction;
  double solid_angle = 0;  // of the bilinear hat that the texel is: that of the texel itself
};

SunnySky sunny_sky() {
  SunnySky out;
  out.sky = {.name = "sun", .width = 2048, .height = 1024, .radiance = std::vector<Vec3f>(2048 * 1024, {1, 1, 1})};
  constexpr int kColumn = 700, kRow = 300;
  out.sky.radiance[kRow * 2048 + kColumn] = {1e6F, 1e6F, 1e6F};
  const double phi = 2 * kPi * ((kColumn + 0.5) / 2048 - 0.5), theta = kPi * (kRow + 0.5) / 1024;
  out.direction = {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
  out.solid_angle = 2 * kPi / 2048 * kPi / 1024 * std::sin(theta);
  return out;
}

TEST(ExtremeLight, ASunAMillionTimesItsSkyIsProjectedAsThePointThatItIs) {
  const SunnySky sunny = sunny_sky();
  const std::vector<Vec3f> light = project_environment(sunny.sky, kMaxShOrder);
  std::array<double, sh_count(kMaxShOrder)> y{};
  evaluate_sh(kMaxShOrder, sunny.direction, y.data());
  const double sun = (1e6 - 1) * sunny.solid_angle;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double truth = sun * y[i] + (i == 0 ? std::sqrt(4 * kPi) : 0);
    // The hat is two texels wide: a band-9 function bends by (9 pi / 1024)^2 / 6 = 1e-4 over it.
    EXPECT_NEAR(light[i].x, truth, 2e-4 * sun) << i;
  }
}

TEST(ExtremeLight, ASunAMillionTimesItsSkyIsFoundByThePathTracer) {
  const SunnySky sunny = sunny_sky();
  Scene scene = kiln::testing::empty_scene();
  kiln::testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const std::vector<ReferencePoint> points(64, {{0.1F, 0, 0.1F}, {0, 1, 0}, {0, 1, 0}});
  const ReferenceResult r = trace_reference(tracer, points, {.environments = {sunny.sky}}, {.samples = 128}, threads);
  double mean = 0;
  for (const Vec3d& x : r.value) mean += x.x / 64;
  const double truth = 1 + (1e6 - 1) * sunny.solid_angle * sunny.direction.y / kPi;
  // Inside a cell of the sampler the map is a hat, sampled uniformly: 8192 samples of spread 1, four of them.
  EXPECT_NEAR(mean / truth, 1, 4 / std::sqrt(8192.0));
}

TEST(ExtremeLight, AnEmitterThatTouchesAWallLightsItByItsFormFactor) {
  // The emitter stands on the floor along z = 0, 0.9 wide and 0.45 high, and shines along +z.
  Scene scene = kiln::testing::empty_scene();
  kiln::testing::add_grid(scene, {-0.45F, 0, 0.45F}, {0.9F, 0, 0}, {0, 0, -0.45F}, 1, 1);
  const std::uint32_t part = kiln::testing::add_part(scene, {0, 0, 0});
  scene.materials.back().emission = {1, 1, 1};
  kiln::testing::add_grid(scene, {-0.45F, 0, 0}, {0.9F, 0, 0}, {0, 0.45F, 0}, 1, 1, part);
  for (const double d : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
    // From a point at distance d to a perpendicular rectangle: twice that of half its width a, with height b.
    const double a = 0.45, b = 0.45;
    const double truth = (std::atan(a / d) - d / std::hypot(d, b) * std::atan(a / std::hypot(d, b))) / kPi;
    const auto z = static_cast<float>(d);
    const TransferPoint point{{0, 0, z}, {0, 1, 0}, {0, 0, z}, {0, 1, 0}};
    const float light = lamps_at(scene, std::span(&point, 1), 4096)[0].x;
    // 1024 cosine rays keep it bounded: 0.5 / 1024^0.75 = 3e-3, three of them. The lift of 1.9e-6 sees 0.2 more at
    // 1e-5.
    EXPECT_NEAR(light, truth, 0.01 + 1.9e-6 / d / kPi) << d;
  }
}

TEST(ExtremeLight, LightsInsideASolidStayInside) {
  Scene scene = kiln::testing::empty_scene();
  kiln::testing::add_grid(scene, {-0.5F, -0.2F, 0.5F}, {1, 0, 0}, {0, 0, -1}, 6, 6);
  kiln::testing::add_box(scene, {-0.13F, -0.1F, -0.11F}, {0.12F, 0.1F, 0.14F}, 3, false);
  const std::size_t count = scene.mesh.position.size();
  scene.lights.push_back({.type = LightType::point, .intensity = {1e8F, 1e8F, 1e8F}, .position = {0.01F, 0.02F, 0}});
  scene.lights.push_back({.type = LightType::spot, .intensity = {1e8F, 1e8F, 1e8F}, .direction = {0, -1, 0}});
  std::vector<TransferPoint> points = vertex_points(scene.mesh);
  double rays = 0, bright = 0;
  for (const Vec3f& x : lamps_at(scene, points, 16)) EXPECT_EQ(x, Vec3f{});
  // An emitter inside, found by many rays: what slips through an edge is less than one ray in a hundred thousand.
  add_lamp(scene, 0.05F, 0.05F, 1);
  points.resize(count);
  for (const Vec3f& x : lamps_at(scene, points, 4096)) rays += 4096 + 1024, bright += x.x;
  EXPECT_LE(bright / static_cast<double>(count), 1e-5);
  EXPECT_GT(rays, 1e5);
}

TEST(ExtremeLight, StrongLampsDoNotSpoilTheCertificateOfAFaintSky) {
  // An open floor: the sky's light is exact there. A lamp of 1e8 adds to the same numbers, and must not round them
  // away.
  Sample s;
  s.positions({-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1});
  s.indices({0, 1, 2, 0, 2, 3});
  const std::string rest =
      "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
      "\"nodes\":[{\"mesh\":0},{\"rotation\":[-0.70710678,0,0,0.70710678],"
      "\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}],\"scenes\":[{\"nodes\":[0,1]}],\"scene\":0,"
      "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"directional\",\"intensity\":1e8}]}}";
  BakeInput input{.scene = {.name = "scene.glb", .main = s.glb(rest)}};
  input.recipe = *parse_recipe(
      R"({"environment":{"constant":[1,1,1]},"steps":[{"do":"prt","order":3,"samples":64,"bounces":0}]})");
  Threads threads(2);
  const auto output = bake(input, {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto certificate = report_of(*output)["certificate"];
  // Nothing varies over the floor, so all that is left is rounding: 2^-13 of a row's largest, twice. The reference
  // knows the constant sky and the lamp without noise; lobes it knows to a hundredth, and their error as none.
  for (const auto& lighting : certificate["lightings"]) {
    const auto name = lighting["name"].get<std::string>();
    if (name != "constant" && name != "lamps") continue;
    EXPECT_LT(lighting["relrmse"].get<double>(), 3e-4) << name;
  }
  EXPECT_LT(certificate["job_light"]["relrmse"].get<double>(), 3e-4);
  EXPECT_LT(certificate["interval"][0].get<double>(), 3e-4) << certificate.dump();
}

}  // namespace
}  // namespace kiln::test
