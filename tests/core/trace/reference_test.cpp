#include "core/trace/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/expects.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"
#include "core/trace/environment_sampler.h"
#include "tests/core/trace/test_scenes.h"

namespace kiln {
namespace {

using test::add_material;
using test::add_quad;
using test::add_room;
using test::points_on;

constexpr double kPi = std::numbers::pi;
const ReferenceLight kLamps{.scene_lights = true};
const ReferenceLight kWhiteSky{.environments = {constant_sky({1, 1, 1})}};
const ReferencePoint kFloorPoint{{0, 0, 0}, {0, 1, 0}, {0, 1, 0}};

ReferenceResult run(const Scene& scene, const std::vector<ReferencePoint>& points, const ReferenceLight& light,
                    const ReferenceOptions& options, int count = 2) {
  Threads threads(count);
  return trace_reference(Tracer(scene, threads), points, light, options, threads);
}

struct Mean {
  double value = 0, error = 0;  // one standard error, from the halves
};

/// Mean red over all entries, every point being an independent estimate of one truth.
Mean mean_of(const ReferenceResult& result) {
  Mean mean;
  for (std::size_t i = 0; i < result.value.size(); ++i) {
    mean.value += result.value[i].x;
    mean.error += std::pow((result.half_a[i].x - result.half_b[i].x) / 2, 2);
  }
  const auto n = static_cast<double>(result.value.size());
  return {mean.value / n, std::sqrt(mean.error) / n};
}

/// Form factor from a point to a parallel rectangle with one corner straight above it: sides a, b, distance 1.
double corner_factor(double a, double b) {
  const double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  return (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / (2 * kPi);
}

Scene open_floor() {
  Scene scene;
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {0.5F, 0.5F, 0.5F}));
  return scene;
}

TEST(Reference, UnoccludedPlaneUnderAConstantSkyIsExactlyOne) {
  const Scene scene = open_floor();
  for (const Vec3d& value : run(scene, points_on(scene, 0, 2, 50), kWhiteSky, {.samples = 64}).value)
    EXPECT_EQ(value, (Vec3d{1, 1, 1}));
}

TEST(Reference, ClosedRoomIsDarkUnderAnySky) {
  Scene scene;
  add_room(scene, 0.5F, add_material(scene, {0.9F, 0.9F, 0.9F}));
  for (const Vec3d& value : run(scene, points_on(scene, 0, 12, 50), kWhiteSky, {.samples = 64}).value)
    EXPECT_EQ(value, Vec3d{});
}

TEST(Reference, WhiteFurnaceHasTheRadiosityOfItsGeometricSeries) {
  for (const double rho : {0.0, 0.5, 0.9, 0.99}) {
    Scene scene;
    const auto albedo = static_cast<float>(rho), emission = static_cast<float>(1 - rho);
    add_room(scene, 0.5F, add_material(scene, {albedo, albedo, albedo}, {emission, emission, emission}));
    const Mean mean = mean_of(run(scene, points_on(scene, 0, 12, 100), kLamps, {.samples = rho < 0.95 ? 128 : 32}));
    EXPECT_NEAR(mean.value, 1, 4 * mean.error + 1e-6) << "albedo " << rho;
    EXPECT_LT(mean.error, 0.02);
  }
}

TEST(Reference, FurnaceOfAlbedoOneIsLimitedTo999Thousandths) {
  Scene scene;
  add_room(scene, 0.5F, add_material(scene, {1, 1, 1}, {0.001F, 0.001F, 0.001F}));
  const Mean mean = mean_of(run(scene, points_on(scene, 0, 12, 40), kLamps, {.samples = 16}));
  EXPECT_NEAR(mean.value, 1, 4 * mean.error);
  EXPECT_LT(mean.error, 0.1);
}

TEST(Reference, EveryBounceAddsOneTermOfTheSeries) {
  Scene scene;
  add_room(scene, 0.5F, add_material(scene, {0.5F, 0.5F, 0.5F}, {1, 1, 1}));
  double truth = 0;
  for (int bounces = 0; bounces < 4; ++bounces) {
    truth += std::pow(0.5, bounces);
    const Mean mean = mean_of(run(scene, points_on(scene, 0, 12, 100), kLamps, {.samples = 128, .bounces = bounces}));
    EXPECT_NEAR(mean.value, truth, 4 * mean.error) << bounces;
  }
}

TEST(Reference, LightThatMustHaveBeenReflectedIsTheRestOfTheSeries) {
  Scene scene;
  add_room(scene, 0.5F, add_material(scene, {0.5F, 0.5F, 0.5F}, {1, 1, 1}));
  for (const int from : {1, 2}) {
    const ReferenceOptions options{.samples = 128, .bounces = 3, .from = from};
    const Mean mean = mean_of(run(scene, points_on(scene, 0, 12, 100), kLamps, options));
    EXPECT_NEAR(mean.value, (from == 1 ? 0.5 : 0) + 0.25 + 0.125, 4 * mean.error) << from;
  }
  EXPECT_EQ(run(open_floor(), {kFloorPoint}, kWhiteSky, {.samples = 64, .from = 1}).value[0], Vec3d{});
}

TEST(Reference, SolidBodyOfAnyAlbedoUnderAWhiteSkyStaysWhite) {
  // Convex: nothing but sky is seen, so the value is exactly 1 whatever the albedo.
  Scene scene;
  test::add_sphere(scene, 0.4F, 12, add_material(scene, {0.7F, 0.7F, 0.7F}));
  std::vector<ReferencePoint> points = points_on(scene, 0, scene.mesh.triangles.size(), 100);
  for (ReferencePoint& p : points) p.normal = p.face_normal;  // no facet lies above its own plane
  for (const Vec3d& value : run(scene, points, kWhiteSky, {.samples = 64}).value) EXPECT_EQ(value.y, 1);
}

TEST(Reference, TwoParallelUnitSquaresHaveTheFormFactorOfTheBook) {
  Scene scene;
  add_quad(scene, {-0.5F, -0.5F, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {0, 0, 0}));
  add_quad(scene, {-0.5F, 0.5F, -0.5F}, {1, 0, 0}, {0, 0, 1}, add_material(scene, {0, 0, 0}, {1, 1, 1}));
  std::vector<ReferencePoint> points;
  std::vector<double> weights;
  for (const QuadratureNode& x : gauss_legendre(8)) {  // 8 x 8 nodes leave 1e-9 of this smooth function
    for (const QuadratureNode& z : gauss_legendre(8)) {
      points.push_back({{static_cast<float>(x.x / 2), -0.5F, static_cast<float>(z.x / 2)}, {0, 1, 0}, {0, 1, 0}});
      weights.push_back(x.weight * z.weight / 4);
    }
  }
  const ReferenceResult result = run(scene, points, kLamps, {.samples = 4096});
  double factor = 0, variance = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    factor += weights[i] * result.value[i].x;
    variance += std::pow(weights[i] * (result.half_a[i].x - result.half_b[i].x) / 2, 2);
  }
  EXPECT_NEAR(factor, 0.199825, 4 * std::sqrt(variance));
  EXPECT_LT(std::sqrt(variance), 1e-4);
}

TEST(Reference, SheetOverHalfOfThePointTakesItsFormFactorFromTheSky) {
  Scene scene;
  add_quad(scene, {0, 0.1F, -0.5F}, {0, 0, 1}, {0.5F, 0, 0}, add_material(scene, {0, 0, 0}));
  const double truth = 1 - 2 * corner_factor(5, 5);
  const Mean mean = mean_of(run(scene, std::vector<ReferencePoint>(200, kFloorPoint), kWhiteSky, {.samples = 256}));
  EXPECT_NEAR(mean.value, truth, 4 * mean.error);
  EXPECT_LT(mean.error, 1e-3);
}

TEST(Reference, TexturedEmitterShinesWhereItsTextureIsBright) {
  // The half of the lamp over x > 0 is lit: a quarter plane's factor twice.
  for (const bool lit_right : {true, false}) {
    Scene scene;
    const int lamp = add_material(scene, {0, 0, 0}, {3, 3, 3});
    const std::uint8_t left = lit_right ? 0 : 255, right = lit_right ? 255 : 0;
    const int texture = test::add_texture(scene, 2, 1, {left, left, left, 255, right, right, right, 255});
    scene.materials[static_cast<std::size_t>(lamp)].emission_texture.texture = texture;
    add_quad(scene, {-0.5F, 0.5F, -0.25F}, {1, 0, 0}, {0, 0, 0.5F}, lamp);
    const ReferencePoint point{{0.25F, 0, 0}, {0, 1, 0}, {0, 1, 0}};
    // From x = .25: the right half spans -.25 .. .25, the left one -.75 .. -.25; lengths over the distance .5.
    const double near = 4 * corner_factor(0.5, 0.5), far = 2 * (corner_factor(1.5, 0.5) - corner_factor(0.5, 0.5));
    const Mean mean = mean_of(run(scene, std::vector<ReferencePoint>(200, point), kLamps, {.samples = 256}));
    EXPECT_NEAR(mean.value, 3 * (lit_right ? near : far), 4 * mean.error);
    EXPECT_LT(mean.error, 0.003);
  }
}

TEST(Reference, EmitterCutAwayByItsMaskGivesNoLight) {
  Scene scene;
  const int lamp = add_material(scene, {1, 1, 1}, {1, 1, 1});
  Material& material = scene.materials[static_cast<std::size_t>(lamp)];
  material.base_color_texture.texture = test::add_texture(scene, 2, 1, {255, 255, 255, 0, 255, 255, 255, 255});
  material.alpha_mode = AlphaMode::mask;
  add_quad(scene, {-0.5F, 0.5F, -0.5F}, {1, 0, 0}, {0, 0, 1}, lamp);  // solid over x > 0
  const Mean mean = mean_of(run(scene, std::vector<ReferencePoint>(200, kFloorPoint), kLamps, {.samples = 256}));
  EXPECT_NEAR(mean.value, 2 * corner_factor(1, 1), 4 * mean.error);
}

TEST(Reference, EmitterTouchingTheReceiverKeepsItsVarianceBounded) {
  // A wide strip seen from distance .01 at its foot: half of 1 - sine of what lies above its upper edge.
  Scene scene;
  add_quad(scene, {0.01F, 0, -50}, {0, 0, 100}, {0, 0.5F, 0}, add_material(scene, {0, 0, 0}, {1, 1, 1}));
  const double truth = 0.5 * (1 - 0.01 / std::hypot(0.01, 0.5));
  const Mean mean = mean_of(run(scene, std::vector<ReferencePoint>(100, kFloorPoint), kLamps, {.samples = 256}));
  EXPECT_NEAR(mean.value, truth, 4 * mean.error + 1e-4);  // the strip ends 50 units away: 1e-4
  EXPECT_LT(mean.error, 0.002);
}

Light point_light(const Vec3f& position) {
  Light light;
  light.intensity = {2, 3, 4};
  light.position = position;
  return light;
}

TEST(Reference, PointLightFallsWithTheInverseSquareAndTheCosine) {
  Scene scene = open_floor();
  scene.lights.push_back(point_light({0.3F, 0.4F, 0}));
  const Vec3d value = run(scene, {kFloorPoint}, kLamps, {.samples = 2, .bounces = 0}).value[0];
  const double truth = 2 / 0.25 * 0.8 / kPi;
  EXPECT_NEAR(value.x, truth, 1e-6 * truth);  // positions are floats
  EXPECT_NEAR(value.z, 2 * truth, 2e-6 * truth);
}

TEST(Reference, RangeWindowEndsAPointLight) {
  for (const float range : {0.4F, 0.5F, 1.0F}) {
    Scene scene = open_floor();
    scene.lights.push_back(point_light({0, 0.5F, 0}));
    scene.lights[0].range = range;
    const double window = std::max(0.0, 1 - std::pow(0.5 / double{range}, 4));
    const Vec3d value = run(scene, {kFloorPoint}, kLamps, {.samples = 2, .bounces = 0}).value[0];
    EXPECT_NEAR(value.x, 2 / 0.25 / kPi * window, 1e-6);
  }
}

TEST(Reference, DirectionalLightFallsWithTheCosineAndIsShadowed) {
  Scene scene = open_floor();
  Light sun;
  sun.type = LightType::directional;
  sun.intensity = Vec3f{1, 1, 1} * static_cast<float>(kPi);
  sun.direction = {0.6F, -0.8F, 0};
  scene.lights.push_back(sun);
  EXPECT_NEAR(run(scene, {kFloorPoint}, kLamps, {.samples = 2, .bounces = 0}).value[0].x, 0.8, 1e-6);
  add_quad(scene, {-0.25F, 0.2F, -0.1F}, {0.2F, 0, 0}, {0, 0, 0.2F}, add_material(scene, {0, 0, 0}));
  EXPECT_EQ(run(scene, {kFloorPoint}, kLamps, {.samples = 2, .bounces = 0}).value[0].x, 0);
}

TEST(Reference, SpotHasAFullInnerConeASquaredRampAndNothingOutside) {
  const double inner = 0.2, outer = 0.6;
  for (const double angle : {0.0, 0.15, 0.3, 0.5, 0.61}) {
    Scene scene = open_floor();
    Light spot = point_light({0, 0.5F, 0});
    spot.type = LightType::spot;
    spot.inner_cone = static_cast<float>(inner), spot.outer_cone = static_cast<float>(outer);
    spot.direction = to_float(Vec3d{std::sin(angle), -std::cos(angle), 0});
    scene.lights.push_back(spot);
    const double ramp = (std::cos(angle) - std::cos(outer)) / (std::cos(inner) - std::cos(outer));
    const double cone = std::pow(std::min(1.0, std::max(0.0, ramp)), 2);
    const Vec3d value = run(scene, {kFloorPoint}, kLamps, {.samples = 2, .bounces = 0}).value[0];
    EXPECT_NEAR(value.x, 2 / 0.25 / kPi * cone, 1e-5) << angle;
  }
}

TEST(Reference, SingleSidedFacesAreBlackFromBehindAndDoubleSidedOnesAreNot) {
  for (const bool double_sided : {false, true}) {
    Scene scene;
    add_room(scene, 0.5F, add_material(scene, {0.5F, 0.5F, 0.5F}, {0.5F, 0.5F, 0.5F}, double_sided));
    for (Triangle& t : scene.mesh.triangles) std::swap(t[1], t[2]);  // fronts look outwards
    for (Vec3f& n : scene.mesh.normal) n = -n;
    std::vector<ReferencePoint> points = points_on(scene, 0, 12, 100);
    for (ReferencePoint& p : points) p.normal = -p.normal, p.face_normal = -p.face_normal;
    const Mean mean = mean_of(run(scene, points, kLamps, {.samples = 128}));
    EXPECT_NEAR(mean.value, double_sided ? 1 : 0, 4 * mean.error) << double_sided;
  }
}

TEST(Reference, HarmonicLightOverAnOpenPlaneIsTheClampedCosineTransfer) {
  const Scene scene = open_floor();
  ReferenceLight light;
  light.sh_order = 6;
  Random random(1, 0);
  for (int k = 0; k < 3; ++k) {
    light.sh.emplace_back();
    for (int i = 0; i < 36; ++i) light.sh.back().push_back({random.uniform() - 0.5F, 1, 2});
  }
  const std::size_t count = 200;
  const ReferenceResult result =
      run(scene, std::vector<ReferencePoint>(count, kFloorPoint), light, {.samples = 256, .bounces = 0});
  std::array<float, 36> transfer{};
  clamped_cosine_transfer(6, {0, 1, 0}, transfer.data());
  for (std::size_t k = 0; k < 3; ++k) {
    double truth = 0;
    for (std::size_t i = 0; i < 36; ++i) truth += double{transfer[i]} * double{light.sh[k][i].x};
    const auto part = [&](const std::vector<Vec3d>& all) {
      return std::vector<Vec3d>(all.begin() + static_cast<std::ptrdiff_t>(k * count),
                                all.begin() + static_cast<std::ptrdiff_t>((k + 1) * count));
    };
    const Mean mean = mean_of({part(result.value), part(result.half_a), part(result.half_b)});
    EXPECT_NEAR(mean.value, truth, 4 * mean.error);
    EXPECT_LT(mean.error, 1e-3);
  }
}

/// A dim sky with one bright texel, and its irradiance / pi on the floor by quadrature.
Environment small_sun(float rotation) {
  Environment e{.name = "sun", .width = 64, .height = 32, .radiance = {}, .rotation_deg = rotation, .intensity = 0.5F};
  e.radiance.assign(64 * 32, {0.1F, 0.1F, 0.1F});
  e.radiance[9 * 64 + 20] = {1000, 1000, 1000};
  return e;
}

double irradiance_over_pi(const Environment& e) {
  double sum = 0;
  constexpr int kSteps = 1024;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < 2 * kSteps; ++k) {
      const double theta = kPi / 2 * (i + 0.5) / kSteps, phi = kPi * (k + 0.5) / kSteps;
      const Vec3d w{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
      sum += environment_radiance(e, to_float(w)).x * w.y * std::sin(theta);
    }
  }
  return sum / kPi * (kPi / 2 / kSteps) * (kPi / kSteps);
}

TEST(Reference, SmallSunIsFoundBySamplingTheMapAlsoWhenItIsTurned) {
  const Scene scene = open_floor();
  for (const float rotation : {0.0F, 37.0F}) {
    const ReferenceLight light{.environments = {small_sun(rotation)}};
    const Mean mean = mean_of(run(scene, std::vector<ReferencePoint>(100, kFloorPoint), light, {.samples = 256}));
    EXPECT_NEAR(mean.value, irradiance_over_pi(light.environments[0]), 4 * mean.error + 1e-4);
    EXPECT_LT(mean.error, 0.005 * mean.value);
  }
}

TEST(EnvironmentSampler, DensityIntegratesToOneAndBelongsToItsSamples) {
  const Environment e = small_sun(37);
  const EnvironmentSampler sampler(e);
  ASSERT_TRUE(sampler.useful());
  double total = 0;
  for (const SphereNode& node : sphere_quadrature(500)) total += node.weight * sampler.density(node.direction);
  EXPECT_NEAR(total, 1, 0.01);  // a step function met by a smooth rule
  // E[f / p] is the integral of f; f = the map itself against its projection to band 0.
  double light = 0;
  constexpr std::uint32_t kCount = 1U << 15;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Vec2f u = sobol_owen(i, 5);
    const Vec3d w = sampler.sample({u.x, u.y});
    EXPECT_NEAR(length(w), 1, 1e-12);
    light += environment_radiance(e, to_float(w)).x / sampler.density(w);
  }
  const double truth = project_environment(e, 1)[0].x * std::sqrt(4 * kPi);
  EXPECT_NEAR(light / kCount, truth, 0.005 * truth);
}

TEST(EnvironmentSampler, ConstantSkyHasNothingToChoose) {
  EXPECT_FALSE(EnvironmentSampler(constant_sky({1, 1, 1})).useful());
  EXPECT_FALSE(EnvironmentSampler(Environment{.width = 4, .height = 2, .radiance = std::vector<Vec3f>(8)}).useful());
}

TEST(Reference, NoiseFromTheHalvesIsTheTrueNoise) {
  Scene scene;
  add_quad(scene, {0, 0.1F, -0.5F}, {0.5F, 0, 0}, {0, 0, 1}, add_material(scene, {0, 0, 0}, {1, 1, 1}));
  const ReferenceLight light{.environments = {constant_sky({1, 1, 1}), small_sun(0)}, .scene_lights = true};
  constexpr std::size_t kCount = 2000;
  const ReferenceResult r = run(scene, std::vector<ReferencePoint>(kCount, kFloorPoint), light, {.samples = 64});
  for (std::size_t k = 0; k < 3; ++k) {
    double claimed = 0, mean = 0, square = 0;
    for (std::size_t i = k * kCount; i < (k + 1) * kCount; ++i) {
      claimed += std::pow((r.half_a[i].x - r.half_b[i].x) / 2, 2);
      mean += r.value[i].x, square += r.value[i].x * r.value[i].x;
    }
    const double variance = square / kCount - std::pow(mean / kCount, 2);
    // Either variance is known to sqrt(2 / 2000) = 3 %; heavy tails double that.
    EXPECT_NEAR(claimed / kCount / variance, 1, 0.25) << "lighting " << k;
  }
}

TEST(Reference, SameBitsForOneAndTwoThreads) {
  Scene scene;
  add_room(scene, 0.5F, add_material(scene, {0.5F, 0.5F, 0.5F}, {1, 1, 1}));
  const auto points = points_on(scene, 0, 12, 50);
  const ReferenceResult one = run(scene, points, kLamps, {.samples = 32}, 1);
  const ReferenceResult two = run(scene, points, kLamps, {.samples = 32}, 2);
  EXPECT_EQ(one.value, two.value);
  EXPECT_EQ(one.half_a, two.half_a);
}

TEST(Reference, LightingsShareTheirPathsAndDoNotDisturbEachOther) {
  Scene scene = open_floor();
  add_quad(scene, {0, 0.1F, -0.5F}, {0, 0, 1}, {0.5F, 0, 0}, add_material(scene, {0.5F, 0.5F, 0.5F}));
  const std::vector<ReferencePoint> points(20, kFloorPoint);
  const ReferenceLight both{.environments = {constant_sky({1, 1, 1}), constant_sky({2, 2, 2})}};
  const ReferenceResult result = run(scene, points, both, {.samples = 32});
  const ReferenceResult alone = run(scene, points, kWhiteSky, {.samples = 32});
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(result.value[i], alone.value[i]);
    EXPECT_NEAR(result.value[points.size() + i].x, 2 * alone.value[i].x, 1e-12);
  }
}

TEST(Reference, PointThatIsNotANumberIsAContractViolation) {
  const Scene scene = open_floor();
  ReferencePoint bad = kFloorPoint;
  bad.position.y = std::nanf("");
  EXPECT_THROW(run(scene, {bad}, kWhiteSky, {.samples = 2}), ContractViolation);
}

TEST(Reference, NoPointsAndNoLightAreFine) {
  const Scene scene = open_floor();
  EXPECT_TRUE(run(scene, {}, kWhiteSky, {.samples = 2}).value.empty());
  EXPECT_TRUE(run(scene, {kFloorPoint}, {}, {.samples = 2}).value.empty());
  EXPECT_EQ(run(Scene{}, {kFloorPoint}, kLamps, {.samples = 2}).value[0], Vec3d{});
}

TEST(Reference, StopsWhenAsked) {
  const Scene scene = open_floor();
  Threads threads(2);
  const Tracer tracer(scene, threads);
  threads.stop();
  EXPECT_THROW(trace_reference(tracer, std::vector{kFloorPoint}, kWhiteSky, {}, threads), Cancelled);
}

}  // namespace
}  // namespace kiln
