// The reference for glossy points: closed forms, and quadrature of the lobe.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/sphere/sh.h"
#include "core/trace/ggx.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"
#include "tests/core/trace/test_scenes.h"

namespace kiln {
namespace {

using test::add_material;
using test::add_quad;

const ReferencePoint kFloorPoint{{0, 0, 0}, {0, 1, 0}, {0, 1, 0}};

Scene open_floor() {
  Scene scene;
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {0.5F, 0.5F, 0.5F}));
  return scene;
}

EyedPoint eyed(double nv, double roughness, const Vec3d& f0) {
  const auto side = static_cast<float>(std::sqrt(1 - nv * nv));
  return {kFloorPoint, {side, static_cast<float>(nv), 0}, ggx_alpha(roughness), f0};
}

struct Mean {
  Vec3d value;
  double error = 0;  // standard error of red, from the halves of many copies of the point
};

Mean run(const Scene& scene, const EyedPoint& point, const ReferenceLight& light, std::size_t lighting = 0) {
  Threads threads(2);
  const std::vector<EyedPoint> points(64, point);
  const ReferenceResult result = trace_specular(Tracer(scene, threads), points, light, {.samples = 256}, threads);
  Mean out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t at = lighting * points.size() + i;
    out.value += result.value[at] / 64.0;
    out.error += std::pow((result.half_a[at].x - result.half_b[at].x) / 2 / 64, 2);
  }
  out.error = std::sqrt(out.error);
  return out;
}

/// Mean of f(l) over the lobe by a regular grid of drawn directions: directional albedo for f = F.
template <class F>
double over_lobe(double nv, double roughness, const F& f) {
  constexpr int kSide = 256;
  const Vec3d v{std::sqrt(1 - nv * nv), 0, nv};
  double sum = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const GgxSample s = sample_ggx(ggx_alpha(roughness), v, {(i / kSide + 0.5) / kSide, (i % kSide + 0.5) / kSide});
    if (s.weight > 0) sum += s.weight * f(v, s.l) / (kSide * kSide);
  }
  return sum;
}

TEST(Specular, OpenPointUnderAWhiteSkyShowsItsDirectionalAlbedo) {
  for (const double roughness : {0.1, 0.5, 1.0}) {
    for (const double nv : {0.2, 0.9}) {
      const Vec3d f0{0.04, 0.5, 1};
      const Mean mean = run(open_floor(), eyed(nv, roughness, f0), {.environments = {constant_sky({1, 1, 1})}});
      for (std::size_t c = 0; c < 3; ++c) {
        const double truth = over_lobe(
            nv, roughness, [&](const Vec3d& v, const Vec3d& l) { return f0[c] + (1 - f0[c]) * schlick_weight(v, l); });
        EXPECT_NEAR(mean.value[c], truth, 4 * mean.error + 2e-3) << roughness << ' ' << nv;  // the grid: 1e-3
      }
    }
  }
}

TEST(Specular, AMapAndItsSamplerGiveTheIntegralOfTheLobeOverIt) {
  Environment map;
  map.width = 32;
  map.height = 16;
  map.radiance.assign(32 * 16, {0.1F, 0.1F, 0.1F});
  for (std::size_t x = 12; x < 18; ++x) map.radiance[5 * 32 + x] = {30, 30, 30};  // a lamp in the sky
  for (const double roughness : {0.4, 0.8}) {
    const EyedPoint point = eyed(0.7, roughness, {1, 1, 1});
    const Mean mean = run(open_floor(), point, {.environments = {map}});
    const Basis<double> basis = basis_around(Vec3d{0, 1, 0});
    const Vec3d v = basis.to_local(to_double(point.view));
    double truth = 0;
    constexpr int kSide = 1000;
    for (int i = 0; i < kSide * kSide; ++i) {
      const GgxSample s = sample_ggx(point.alpha, v, {(i / kSide + 0.5) / kSide, (i % kSide + 0.5) / kSide});
      if (s.weight > 0)
        truth += s.weight * environment_radiance(map, to_float(basis.to_world(s.l))).x / (kSide * kSide);
    }
    EXPECT_NEAR(mean.value.x, truth, 4 * mean.error + 0.005 * truth);  // the grid
    EXPECT_LT(mean.error, 0.02 * truth);
  }
}

TEST(Specular, AMirrorShowsTheLampOverItAndTheDiffuseLightBesideIt) {
  Scene scene = open_floor();
  add_quad(scene, {-0.5F, 0.25F, -0.5F}, {1, 0, 0}, {0, 0, 1}, add_material(scene, {0, 0, 0}, {3, 2, 1}));
  const Mean lamp = run(scene, eyed(0.9, 0, {1, 1, 1}), {.scene_lights = true});
  EXPECT_NEAR(lamp.value.x, 3, 1e-2);  // roughness .03 loses next to nothing
  EXPECT_NEAR(lamp.value.z, 1, 1e-2);
  // A white wall of albedo 0.5 in place of the lamp, lit by a white sky from behind the eye's side only: a closed form
  // is what the diffuse reference says of the point that the mirror shows.
  Scene wall = open_floor();
  add_quad(wall, {-0.3F, 0, -0.5F}, {0, 0.5F, 0}, {0, 0, 1}, add_material(wall, {0.5F, 0.5F, 0.5F}));  // faces +x
  const ReferenceLight sky{.environments = {constant_sky({1, 1, 1})}};
  const double nv = std::sqrt(0.5);
  const Mean seen = run(wall, eyed(nv, 0, {1, 1, 1}), sky);
  Threads threads(2);
  const std::vector<ReferencePoint> there(64, {{-0.3F, 0.3F, 0}, {1, 0, 0}, {1, 0, 0}});
  const ReferenceResult diffuse = trace_reference(Tracer(wall, threads), there, sky, {.samples = 256}, threads);
  double value = 0;
  for (const Vec3d& x : diffuse.value) value += x.x / 64;
  EXPECT_NEAR(seen.value.x, 0.5 * value, 4 * seen.error + 5e-3);
}

Mean run_kernel(const Scene& scene, const EyedPoint& point, const std::vector<double>& kernel,
                const ReferenceLight& light) {
  Threads threads(2);
  const std::vector<EyedPoint> points(64, point);
  const std::vector<std::vector<double>> kernels(64, kernel);
  const ReferenceResult result =
      trace_kernels(Tracer(scene, threads), {points, kernels}, light, {.samples = 256}, threads);
  Mean out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.value += result.value[i] / 64.0;
    out.error += std::pow((result.half_a[i].x - result.half_b[i].x) / 2 / 64, 2);
  }
  out.error = std::sqrt(out.error);
  return out;
}

TEST(Specular, AKernelIsIntegratedOverTheHalfSpaceOnly) {
  // Light Y_1-1 = c y over the floor, c = sqrt(3 / 4 pi): with a kernel of 1 (2 sqrt(pi) Y_00) c pi, with one of Y_1-1
  // half of its norm, 1/2; with Y_10 = c z nothing, by symmetry.
  std::vector<Vec3f> up(4);
  up[1] = {1, 1, 1};
  const ReferenceLight light{.sh_order = 2, .sh = {up}};
  const double root = 2 * std::sqrt(std::numbers::pi), c = std::sqrt(3 / (4 * std::numbers::pi));
  for (const double roughness : {0.2, 0.7}) {
    const EyedPoint point = eyed(0.8, roughness, {1, 1, 1});
    const Mean constant = run_kernel(open_floor(), point, {root}, light);
    const Mean same = run_kernel(open_floor(), point, {0, 1, 0, 0}, light);
    const Mean across = run_kernel(open_floor(), point, {0, 0, 1, 0}, light);
    EXPECT_NEAR(constant.value.x, c * std::numbers::pi, 4 * constant.error);
    EXPECT_NEAR(same.value.y, 0.5, 4 * same.error);
    EXPECT_NEAR(across.value.z, 0, 4 * across.error);
    EXPECT_LT(constant.error + same.error + across.error, 0.06);
  }
}

TEST(Specular, AKernelSeesWhatHidesTheSkyAndTheSunOfAMap) {
  Scene scene = open_floor();
  add_quad(scene, {0, 0, -50}, {0, 50, 0}, {0, 0, 100}, add_material(scene, {0, 0, 0}));
  add_quad(scene, {0, 0, -50}, {0, 0, 100}, {0, 50, 0}, add_material(scene, {0, 0, 0}));
  EyedPoint point = eyed(0.8, 0.5, {1, 1, 1});
  point.at.position = {-0.01F, 0, 0};
  const std::vector<double> one{2 * std::sqrt(std::numbers::pi)};
  const Mean half = run_kernel(scene, point, one, {.environments = {constant_sky({1, 1, 1})}});
  EXPECT_NEAR(half.value.x, std::numbers::pi, 4 * half.error + 2e-3);  // the wall ends: 4e-4 of the half space
  Environment map;
  map.width = 32;
  map.height = 16;
  map.radiance.assign(32 * 16, {0, 0, 0});
  double truth = 0;  // solid angle of the rows above the horizon, one texel of each
  for (std::size_t y = 0; y < 8; ++y) {
    map.radiance[y * 32 + 3] = {40, 40, 40};
    const double top = std::cos(std::numbers::pi * static_cast<double>(y) / 16);
    truth += 40 * (top - std::cos(std::numbers::pi * static_cast<double>(y + 1) / 16)) * 2 * std::numbers::pi / 32;
  }
  const Mean sun = run_kernel(open_floor(), eyed(0.8, 0.5, {1, 1, 1}), one, {.environments = {map}});
  EXPECT_NEAR(sun.value.x, truth, 4 * sun.error + 0.03 * truth);  // texels are interpolated at their rims
  EXPECT_LT(sun.error, 0.02 * truth);
}

TEST(Specular, FinishIsFactorTimesTextureInBlueAndGreen) {
  Scene scene = open_floor();
  scene.materials[0].metallic = 0.5F;
  scene.materials[0].roughness = 0.8F;
  EXPECT_FLOAT_EQ(finish_at(scene, surface_point(scene, 0, 0.2F, 0.2F)).metallic, 0.5F);
  scene.images.push_back({"finish", "image/png", {}, 1, 1, {255, 51, 102, 255}});
  scene.textures.push_back({0});
  scene.materials[0].metallic_roughness_texture.texture = 0;
  const SurfaceFinish finish = finish_at(scene, surface_point(scene, 0, 0.2F, 0.2F));
  EXPECT_NEAR(finish.metallic, 0.5 * 0.4, 1e-6);
  EXPECT_NEAR(finish.roughness, 0.8 * 0.2, 1e-6);
}

}  // namespace
}  // namespace kiln
