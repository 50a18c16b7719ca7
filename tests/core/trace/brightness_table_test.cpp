// Textured emitters: no place that shines is missed, and no ray is spent on what is black.
#include "core/trace/brightness_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/sphere/sampling.h"
#include "core/trace/lights.h"
#include "tests/core/trace/test_scenes.h"

namespace kiln {
namespace {

/// Black but for some texels.
Image image_of(int width, int height, const std::vector<std::array<int, 2>>& white) {
  Image image;
  image.width = width, image.height = height;
  image.rgba.assign(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  for (const auto& [x, y] : white) {
    for (std::size_t c = 0; c < 3; ++c)
      image
          .rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) + c] =
          255;
  }
  return image;
}

/// A quad with an emission texture.
Scene sign(Image image, Wrap wrap = Wrap::repeat, bool nearest = false) {
  Scene scene;
  const int material = test::add_material(scene, {}, {1, 2, 3});
  scene.images.push_back(std::move(image));
  scene.textures.push_back({.image = 0, .wrap_u = wrap, .wrap_v = wrap, .nearest = nearest});
  scene.materials.back().emission_texture.texture = 0;
  test::add_quad(scene, {0, 0, 0}, {0.5F, 0, 0}, {0, 0, 0.5F}, material);
  return scene;
}

TEST(BrightnessTable, MeanOfATriangleIsThatOfItsTexelsAndAMargin) {
  std::vector<std::array<int, 2>> left;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 32; ++x) left.push_back({x, y});
  }
  const BrightnessTable table(image_of(64, 64, left));
  const Texture texture;
  const auto mean = [&](double x0, double x1) {
    return table.mean({Vec2d{x0, 0.2}, Vec2d{x1, 0.2}, Vec2d{x0, 0.8}}, 0, texture);
  };
  EXPECT_EQ(mean(0.1, 0.4), 1);
  EXPECT_EQ(mean(0.6, 0.9), 0);
  EXPECT_EQ(mean(1.6, 1.9), 0) << "one period on";
  EXPECT_EQ(mean(-0.9, -0.6), 1);
  // Three quarters of a right triangle lie in the first half of its base; boxes at its outline count whole.
  EXPECT_NEAR(mean(0.25, 0.75), 0.75, 0.1);
  EXPECT_EQ(mean(-1e200, 1e200), 0.5) << "nothing is told apart: the mean of all";
}

/// Whatever the coordinates, their transform and the wrap modes are: where something shines, a sample may fall.
TEST(BrightnessTable, NoPlaceThatShinesIsMissed) {
  int shining = 0, dark = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    Random random(seed, 0, 0);
    const auto number = [&](double low, double high) { return low + (high - low) * random.uniform_double(); };
    const int width = 1 + static_cast<int>(number(0, 40)), height = 1 + static_cast<int>(number(0, 40));
    std::vector<std::array<int, 2>> white;
    for (int i = 0; i < 3; ++i)
      white.push_back({static_cast<int>(number(0, width)), static_cast<int>(number(0, height))});
    const auto wrap = static_cast<Wrap>(seed % 3);
    Scene scene = sign(image_of(width, height, white), wrap, seed % 2 == 0);
    const double reach = std::pow(10, number(-2, 3));
    for (Vec2f& uv : scene.mesh.uv0)
      uv = {static_cast<float>(number(-reach, reach)), static_cast<float>(number(-reach, reach))};
    for (float& m : scene.materials[0].emission_texture.transform) m = static_cast<float>(number(-1.5, 1.5));
    const EmitterSampler emitters(scene);
    for (int i = 0; i < 200; ++i) {
      const auto triangle = static_cast<std::uint32_t>(i % 2);
      const Vec2<double> b{random.uniform_double(), random.uniform_double()};
      const SurfacePoint p =
          surface_point(scene, triangle, static_cast<float>(b.x * (1 - b.y)), static_cast<float>(b.y));
      const bool shines = emission_at(scene, p) != Vec3f{};
      EXPECT_TRUE(!shines || emitters.density(triangle) > 0) << "seed " << seed;
      shining += shines ? 1 : 0;
      dark += emitters.density(triangle) == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(shining, 1000);  // else nothing was asked
  EXPECT_GT(dark, 1000);
}

/// Of a wall of 1024 tiles that share one image one shines: all samples go there, and their mean is what it sends.
TEST(EmitterSampler, SpendsNoSampleOnBlackTiles) {
  Scene scene = sign(image_of(64, 64, {}));
  scene.images[0] = image_of(64, 64, {{32, 32}, {33, 32}, {32, 33}, {33, 33}});
  scene.mesh = {}, scene.parts.clear();
  constexpr int kTiles = 32;
  for (int y = 0; y < kTiles; ++y) {
    for (int x = 0; x < kTiles; ++x) {
      test::add_quad(scene, {static_cast<float>(x) / 64, 0, static_cast<float>(y) / 64}, {1.0F / 64, 0, 0},
                     {0, 0, 1.0F / 64}, 0);
      for (std::size_t k = 0; k < 4; ++k) {
        Vec2f& uv = scene.mesh.uv0[scene.mesh.uv0.size() - 4 + k];
        uv = {(static_cast<float>(x) + uv.x) / kTiles, (static_cast<float>(y) + uv.y) / kTiles};
      }
    }
  }
  const EmitterSampler emitters(scene);
  double red = 0;
  int hits = 0;
  constexpr int kSamples = 4096;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec2f u = sobol_owen(i, 1), v = sobol_owen(i, 2);
    const EmitterSample s = emitters.sample(u.x, {v.x, v.y});
    red += s.radiance.x / s.density / kSamples;
    hits += s.radiance != Vec3d{} ? 1 : 0;
  }
  // Bilinear filtering moves no light: four texels of a wall of 1/4.
  const double sent = 4.0 / (64 * 64) / 4;
  EXPECT_NEAR(red, sent, 0.05 * sent);  // four standard errors of 4096 independent samples, a third of which shine
  EXPECT_GT(hits, kSamples / 20) << "by area alone 1 in 450 would shine";
}

}  // namespace
}  // namespace kiln
