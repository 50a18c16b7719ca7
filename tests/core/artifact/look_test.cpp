#include "core/artifact/look.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/artifact/evaluate.h"
#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/sample_scene.h"

namespace kiln {
namespace {

TEST(ToneMap, IsTheIdentityUpToTheKneeAndRisesTowardsOne) {
  EXPECT_EQ(tone_map(0.0F), 0);
  EXPECT_EQ(tone_map(0.35F), 0.35F);
  EXPECT_EQ(tone_map(0.6F), 0.6F);
  float before = 0;
  for (float x = 0; x < 4; x += 0.01F) {
    EXPECT_GE(tone_map(x), before);
    before = tone_map(x);
    EXPECT_LT(before, 1);
  }
}

TEST(ToneMap, HasNoCornerAtTheKnee) {
  const float h = 1e-3F;
  const float slope = (tone_map(0.6F + h) - tone_map(0.6F)) / h;
  EXPECT_NEAR(slope, 1, h / 0.4F / 2 + 1e-4F);  // the curvature's share of a one-sided difference, and rounding
}

TEST(ToneMap, ShowsRingingBelowZeroAndNoNumberAsBlack) {
  EXPECT_EQ(tone_map(-0.2F), 0);
  EXPECT_EQ(tone_map(std::nanf("")), 0);
}

TEST(AutomaticExposure, ShowsTheBrightPartsAtFourFifths) {
  const BakedScene scene = sphere_over_plane(2, 1, false);
  for (const float radiance : {1e-8F, 1.0F, 1e8F}) {
    const std::vector<Vec3f> constant(scene.scene.mesh.position.size(), Vec3f{radiance, radiance / 2, 0});
    EXPECT_NEAR(tone_map(radiance * automatic_exposure(scene.scene.mesh, constant)), 0.8F, 1e-6F);
  }
}

TEST(AutomaticExposure, IgnoresASmallLampAndAreaWithoutLight) {
  const BakedScene scene = random_baked({.order = 1, .channels = 1});
  std::vector<Vec3f> radiance(scene.scene.mesh.position.size(), Vec3f{2, 2, 2});
  for (std::size_t v = 0; v < 20; ++v) radiance[v] = {1e6F, 1e6F, 1e6F};  // 3 % of the vertices
  for (std::size_t v = 200; v < radiance.size(); ++v) radiance[v] = {};
  EXPECT_NEAR(tone_map(2 * automatic_exposure(scene.scene.mesh, radiance)), 0.8F, 1e-6F);
}

TEST(AutomaticExposure, IsOneInTheDark) {
  const BakedScene scene = random_baked({.order = 1});
  EXPECT_EQ(automatic_exposure(scene.scene.mesh, std::vector<Vec3f>(scene.scene.mesh.position.size())), 1);
}

TEST(BakedColors, AreAlbedoTimesVertexColourTimesValuePlusEmission) {
  BakedScene scene = random_baked({.order = 1, .channels = 3, .fixed = true});
  scene.light.coefficients = {{1, 2, 3}};
  const auto colors = baked_colors(scene);
  const std::size_t v = scene.scene.mesh.position.size() - 1;  // of the last part: material "glow", vertex colours
  const float* t = scene.transfer.at(v, 0);
  const Vec4f& c = scene.scene.mesh.color[v];
  const double expected =
      0.2 * static_cast<double>(c.y) * (2.0 * static_cast<double>(t[2]) + static_cast<double>(t[3])) + 12.5;
  EXPECT_NEAR(colors[v].y, expected, 12.5 * 0x1p-22);  // float rounding of the result
}

TEST(BakedColors, LeaveOutEmissionThatATextureShapes) {
  BakedScene scene = sphere_over_plane(1, 1, false);
  scene.light.coefficients = {};
  scene.scene.materials[0].emission = {5, 5, 5};
  EXPECT_EQ(baked_colors(scene)[0], (Vec3f{5, 5, 5}));
  scene.scene.materials[0].emission_texture.texture = 0;
  EXPECT_EQ(baked_colors(scene)[0], (Vec3f{0, 0, 0}));
}

TEST(Evaluate, InterpolatesAsAViewerDoes) {
  BakedScene scene = single_triangle(1, 3, true);
  for (std::size_t i = 0; i < scene.transfer.coefficients.size(); ++i) {
    scene.transfer.coefficients[i] = static_cast<float>(i);
  }
  const std::vector<Vec3f> light{{10, 20, 30}};
  // Vertex v, channel c: slot 0 is 6v + 2c, the fixed slot 6v + 2c + 1.
  EXPECT_EQ(value_at(scene.transfer, 1, light), (Vec3f{6 * 10 + 7, 8 * 20 + 9, 10 * 30 + 11}));
  EXPECT_EQ(value_at(scene.transfer, 1, {}), (Vec3f{7, 9, 11}));
  const Vec3f middle = value_at(scene.transfer, TrianglePoint{{0, 1, 2}, 0.5F, 0.5F}, light);
  EXPECT_EQ(middle, (value_at(scene.transfer, 1, light) + value_at(scene.transfer, 2, light)) * 0.5F);
}

TEST(Evaluate, ShowsNoPartOfTheLightBelowZero) {
  BakedScene scene = single_triangle(1, 3, true);
  for (std::size_t i = 0; i < scene.transfer.coefficients.size(); ++i)
    scene.transfer.coefficients[i] = static_cast<float>(i);
  const std::vector<Vec3f> bright{{-1, 2, -3}}, rest{{4, -5, 6}}, all{{3, -3, 3}};
  for (std::size_t v = 0; v < 3; ++v) {
    const Vec3f lamps = value_at(scene.transfer, v, {}),
                t = value_at(scene.transfer, v, std::vector<Vec3f>{{1, 1, 1}}) - lamps;
    Vec3f expected;
    for (std::size_t c = 0; c < 3; ++c)
      expected[c] = std::max(0.0F, t[c] * rest[0][c] + lamps[c]) + std::max(0.0F, t[c] * bright[0][c]);
    EXPECT_EQ(shown_at(scene.transfer, v, {all, bright}), expected) << v;
    EXPECT_EQ(shown_at(scene.transfer, v, {all}), value_at(scene.transfer, v, all)) << v;
    EXPECT_EQ(shown_values(scene.transfer, {all, bright})[v], expected) << v;
  }
  const Vec3f middle = shown_at(scene.transfer, TrianglePoint{{0, 1, 2}, 0.5F, 0.5F}, {all, bright});
  EXPECT_EQ(middle, (shown_at(scene.transfer, 1, {all, bright}) + shown_at(scene.transfer, 2, {all, bright})) * 0.5F);
}

}  // namespace
}  // namespace kiln
