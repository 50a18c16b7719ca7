// Light fields of small scenes against the path-traced reference.
#include "core/lightfield/outgoing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "core/lightfield/seen.h"
#include "core/meshless/radiosity.h"
#include "core/prt/lobe_table.h"
#include "core/trace/ggx.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

/// A metal ball beside a diffuse wall.
Scene ball_and_wall(float roughness) {
  Scene scene = testing::empty_scene();
  const std::uint32_t metal = testing::add_part(scene, {0.9F, 0.6F, 0.3F});
  testing::add_sphere(scene, {0, 0, 0}, 0.2F, 24, metal);
  const std::uint32_t wall = testing::add_part(scene, {0.8F, 0.2F, 0.2F});
  testing::add_grid(scene, {-0.4F, -0.4F, 0.4F}, {0, 0.8F, 0}, {0.8F, 0, 0}, 8, 8, wall);
  for (Material& m : scene.materials) m.metallic = 0, m.roughness = 1;
  Material& m = scene.materials[static_cast<std::size_t>(scene.parts[metal].material)];
  m.metallic = 1, m.roughness = roughness;
  return scene;
}

struct Made {
  OutgoingLight light;
  std::vector<Vec3f> value;
};

Made make(const Tracer& tracer, const Environment& sky, OutgoingBake params, Threads& threads) {
  const RadiosityResult r = solve_radiosity(tracer, &sky, {}, threads);
  Made out;
  for (std::size_t v = 0; v < r.direct.size(); ++v) out.value.push_back(r.direct[v] + r.indirect[v]);
  const GatherFaces faces(tracer.scene());
  out.light = bake_outgoing({tracer, faces, r.surface.get(), &sky}, {tracer.scene(), out.value}, params, threads);
  return out;
}

/// relRMSE of vertices of the ball, seen from random directions.
double error_of(const Tracer& tracer, const Environment& sky, const OutgoingLight& light, double roughness,
                Threads& threads) {
  const Mesh& mesh = tracer.scene().mesh;
  const Vec3d f0{0.9, 0.6, 0.3};
  std::vector<EyedPoint> eyes;
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t v = 30; v < 500; v += 7) {
    Random random(1, v);
    const Vec3d n = to_double(mesh.normal[v]);
    vertices.push_back(v);
    eyes.push_back({{mesh.position[v], mesh.normal[v], mesh.normal[v]},
                    to_float(random_view(n, random)),
                    ggx_alpha(roughness),
                    f0});
  }
  const ReferenceResult truth =
      trace_specular(tracer, eyes, {.environments = {sky}}, {.samples = 2048, .seed = 5}, threads);
  std::optional<MirroredSky> mirrored;
  if (light.field.has_sky()) mirrored.emplace(light.sky);
  double squares = 0, mean = 0, noise = 0;
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const std::uint32_t v = vertices[i];
    const Triangle t{v, v, v};
    const Vec3d shown = seen_radiance(light.field, mirrored ? &*mirrored : nullptr,
                                      {t, 0, 0, to_double(mesh.normal[v]), to_double(eyes[i].view), f0, roughness});
    for (std::size_t c = 0; c < 3; ++c) {
      squares += std::pow(shown[c] - truth.value[i][c], 2);
      noise += std::pow((truth.half_a[i][c] - truth.half_b[i][c]) / 2, 2);
      mean += truth.value[i][c];
    }
  }
  const double n = 3 * static_cast<double>(eyes.size());
  return std::sqrt(std::max(0.0, squares - noise) / n) / (mean / n);
}

TEST(Outgoing, AMetalBallBesideAWallLooksAsPathsSeeIt) {
  Threads threads(2);
  const Scene scene = ball_and_wall(0.5F);
  const Tracer tracer(scene, threads);
  const Environment sky = overcast_sky();
  const Made made = make(tracer, sky, {.degree = 8, .rays = 2048}, threads);
  const double error = error_of(tracer, sky, made.light, 0.5, threads);
  std::printf("error %.4f, noise %.4f\n", error, made.light.noise);
  EXPECT_LT(error, 0.02);  // .008 measured: bands 0 to 8 of a lobe of roughness .5, and .003 noise of the rays
  EXPECT_LT(made.light.noise, 0.01);
  EXPECT_GT(made.light.noise, 0.001);
}

TEST(Outgoing, ASmoothBallNeedsTheSkyApart) {
  Threads threads(2);
  const Scene scene = ball_and_wall(0.15F);
  const Tracer tracer(scene, threads);
  const Environment sky = clear_sky_with_sun();
  const double series =
      error_of(tracer, sky, make(tracer, sky, {.degree = 6, .rays = 1024}, threads).light, 0.15, threads);
  const double apart = error_of(
      tracer, sky, make(tracer, sky, {.degree = 6, .rays = 1024, .sky_apart = true}, threads).light, 0.15, threads);
  std::printf("in the series %.3f, apart %.3f\n", series, apart);
  EXPECT_LT(apart, 0.5 * series);
}

/// What sees all of the sky leaves nothing of it to the series.
TEST(Outgoing, InTheOpenTheSkyIsAllApart) {
  Threads threads(2);
  Scene scene = testing::empty_scene();
  const std::uint32_t metal = testing::add_part(scene, {0.9F, 0.6F, 0.3F});
  testing::add_grid(scene, {-0.4F, 0, -0.4F}, {0, 0, 0.8F}, {0.8F, 0, 0}, 3, 3, metal);
  Material& m = scene.materials[static_cast<std::size_t>(scene.parts[metal].material)];
  m.metallic = 1, m.roughness = 0.2F;
  const Tracer tracer(scene, threads);
  const Environment sky = clear_sky_with_sun();
  const std::vector<Vec3f> value(scene.mesh.position.size());
  const GatherFaces faces(scene);
  const auto bake = [&](bool apart) {
    return bake_outgoing({tracer, faces, nullptr, &sky}, {tracer.scene(), value},
                         {.degree = 4, .rays = 512, .sky_apart = apart}, threads);
  };
  const auto largest = [](const OutgoingLight& light) {
    double most = 0;
    for (const float c : light.field.coefficients) most = std::max(most, std::abs(double{c}));
    return most;
  };
  const OutgoingLight apart = bake(true), series = bake(false);
  EXPECT_LT(largest(apart), 0.01 * largest(series));  // .0037: a few rays along the plane meet it
  EXPECT_TRUE(apart.field.has_sky());
  EXPECT_FALSE(series.field.has_sky());
  EXPECT_TRUE(series.sky.empty());
}

/// Diffuse light that is left to the materials is what the series has of it, on a surface of one colour.
TEST(Outgoing, DiffuseLightIsTheSameApart) {
  Threads threads(2);
  Scene scene = ball_and_wall(0.6F);
  for (Material& m : scene.materials) m.metallic = 0.25F;
  const Tracer tracer(scene, threads);
  const Environment sky = overcast_sky();
  const Made apart = make(tracer, sky, {.degree = 8, .rays = 256, .diffuse_apart = true}, threads);
  const Made together = make(tracer, sky, {.degree = 8, .rays = 256}, threads);
  ASSERT_TRUE(apart.light.field.has_diffuse());
  EXPECT_FALSE(together.light.field.has_diffuse());
  // Noise of the same rays over means, of which one leaves out that the specular layer keeps some: .06.
  EXPECT_NEAR(apart.light.noise, together.light.noise, 0.1 * together.light.noise);
  const Vec3d base{0.9, 0.6, 0.3};
  double squares = 0, all = 0, most = 0;
  for (std::uint32_t v = 30; v < 500; v += 7) {
    Random random(3, v);
    const Triangle t{v, v, v};
    const Vec3d n = to_double(scene.mesh.normal[v]);
    const FieldPoint at{.triangle = t,
                        .normal = n,
                        .view = random_view(n, random),
                        .f0 = specular_f0(base, 0.25),
                        .roughness = 0.6,
                        .color = base * 0.75};
    const Vec3d one = seen_radiance(apart.light.field, nullptr, at),
                other = seen_radiance(together.light.field, nullptr, at);
    squares += dot(one - other, one - other), all += dot(other, other);
    FieldPoint black = at;
    black.color = {};
    most = std::max(most, length(seen_radiance(apart.light.field, nullptr, black)) / length(one));
  }
  EXPECT_LT(std::sqrt(squares / all), 0.02);  // what bands 0 to 8 leave of 1 - E, mostly near the horizon
  EXPECT_LT(most, 0.9);                       // diffuse light is some of what is seen
}

TEST(Outgoing, RoughSurfacesKeepNoSkyApart) {
  EXPECT_EQ(share_apart(0.2), 1);
  EXPECT_EQ(share_apart(0.8), 0);
  Threads threads(1);
  const Scene scene = ball_and_wall(0.9F);
  const Tracer tracer(scene, threads);
  const Environment sky = overcast_sky();
  const std::vector<Vec3f> value(scene.mesh.position.size());
  const GatherFaces faces(scene);
  const auto bake = [&](bool apart) {
    return bake_outgoing({tracer, faces, nullptr, &sky}, {tracer.scene(), value},
                         {.degree = 3, .rays = 128, .sky_apart = apart}, threads);
  };
  const OutgoingLight asked = bake(true), not_asked = bake(false);
  EXPECT_FALSE(asked.field.has_sky());
  EXPECT_EQ(asked.field.coefficients, not_asked.field.coefficients);
}

TEST(Outgoing, SameBitsForAnyNumberOfThreads) {
  Scene scene = ball_and_wall(0.5F);
  scene.lights.push_back({.type = LightType::point, .name = {}, .intensity = {1, 1, 1}, .position = {0.3F, 0.3F, 0}});
  const Environment sky = overcast_sky();
  std::vector<float> first;
  for (const int count : {1, 3}) {
    Threads threads(count);
    const Tracer tracer(scene, threads);
    const std::vector<Vec3f> value(scene.mesh.position.size(), {0.5F, 0.5F, 0.5F});
    const GatherFaces faces(scene);
    const OutgoingLight made =
        bake_outgoing({tracer, faces, nullptr, &sky}, {tracer.scene(), value},
                      {.degree = 3, .rays = 128, .sky_apart = true, .lamps_apart = true}, threads);
    ASSERT_TRUE(made.field.has_lamps());
    std::vector<float> numbers = made.field.coefficients;
    numbers.insert(numbers.end(), made.field.lamp_visibility.begin(), made.field.lamp_visibility.end());
    numbers.push_back(made.field.lamps[0].mean.x);
    numbers.insert(numbers.end(), made.field.visibility.begin(), made.field.visibility.end());
    if (first.empty()) first = numbers;
    EXPECT_EQ(first, numbers);
  }
}

TEST(Outgoing, WhatGlowsInTheDarkLooksTheSameFromEverywhere) {
  Threads threads(2);
  Scene scene = testing::empty_scene();
  const std::uint32_t part = testing::add_part(scene, {0, 0, 0});
  testing::add_grid(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, 2, 2, part);
  scene.materials[static_cast<std::size_t>(scene.parts[part].material)].emission = {1, 2, 3};
  const Tracer tracer(scene, threads);
  const std::vector<Vec3f> value(scene.mesh.position.size());
  const GatherFaces faces(scene);
  const OutgoingLight made =
      bake_outgoing({tracer, faces, nullptr, nullptr}, {tracer.scene(), value}, {.degree = 4, .rays = 128}, threads);
  const Triangle& t = scene.mesh.triangles[0];
  for (const Vec3d& v : {Vec3d{0, 1, 0}, normalized(Vec3d{1, 0.1, 0})}) {
    const Vec3d seen = seen_radiance(made.field, nullptr, {t, 0.3, 0.3, to_double(scene.mesh.normal[t[0]]), v});
    EXPECT_NEAR(seen.x, 1, 1e-5);
    EXPECT_NEAR(seen.y, 2, 1e-5);
    EXPECT_NEAR(seen.z, 3, 1e-5);
  }
}

}  // namespace
}  // namespace kiln
