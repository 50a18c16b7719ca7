// Materials, textures, images and lights survive the trip through glTF.

#include <gtest/gtest.h>

#include <cmath>

#include "core/artifact/png.h"
#include "tests/core/artifact/round_trip.h"
#include "tests/core/artifact/sample_scene.h"

namespace kiln {
namespace {

TextureRef turned(float angle, float scale_u, float scale_v) {
  const float c = std::cos(angle), s = std::sin(angle);
  return {0, 1, {c * scale_u, s * scale_v, 0.25F, -s * scale_u, c * scale_v, -3}, 1};
}

void expect_same(const TextureRef& a, const TextureRef& b) {
  EXPECT_EQ(a.texture, b.texture);
  EXPECT_EQ(a.uv_set, b.uv_set);
  EXPECT_EQ(a.scale, b.scale);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(a.transform[i], b.transform[i], 1e-5F) << i;  // a few float roundings
}

TEST(BakedLook, MaterialsComeBack) {
  BakedScene written = sphere_over_plane(1, 1, false);
  Material m;
  m.name = "all \xC3\xA4\xFF";  // with a byte that is not UTF-8
  m.base_color = {0.1F, 0.2F, 0.3F, 0.4F};
  m.base_color_texture = turned(0.7F, 2, 3);
  m.metallic = 0.6F;
  m.roughness = 0.7F;
  m.metallic_roughness_texture = turned(-2, 1, -1);
  m.emission = {0.5F, 40, 7};
  m.emission_texture = {0, 0, {1, 0, 0, 0, 1, 0}, 1};
  m.normal_texture = {0, 0, {1, 0, 0, 0, 1, 0}, 0.5F};
  m.alpha_mode = AlphaMode::mask;
  m.alpha_cutoff = 0.3F;
  m.double_sided = m.unlit = true;
  written.scene.materials[1] = m;
  const Material r = round_trip(written).scene.materials.at(1);
  EXPECT_EQ(r.name, "all \xC3\xA4\xEF\xBF\xBD");
  EXPECT_EQ(r.base_color, m.base_color);
  EXPECT_EQ(r.metallic, m.metallic);
  EXPECT_EQ(r.roughness, m.roughness);
  EXPECT_NEAR(r.emission.x, 0.5F, 1e-6F);
  EXPECT_EQ(r.emission.y, 40);
  EXPECT_EQ(r.alpha_mode, m.alpha_mode);
  EXPECT_EQ(r.alpha_cutoff, m.alpha_cutoff);
  EXPECT_TRUE(r.double_sided && r.unlit);
  expect_same(r.base_color_texture, m.base_color_texture);
  expect_same(r.metallic_roughness_texture, m.metallic_roughness_texture);
  expect_same(r.emission_texture, m.emission_texture);
  expect_same(r.normal_texture, m.normal_texture);
}

TEST(BakedLook, TexturesAndImagesKeepIndexAndBytes) {
  BakedScene written = sphere_over_plane(1, 1, false);
  Scene& scene = written.scene;
  scene.images.push_back({"web", "image/webp", {1, 2, 3}, 0, 0, {}});
  scene.images.push_back({"lost", "image/jpeg", {}, 0, 0, {}});
  scene.textures.push_back({1, Wrap::clamp, Wrap::mirror, true});
  scene.textures.push_back({2, Wrap::repeat, Wrap::repeat, false});
  scene.textures.push_back({-1, Wrap::repeat, Wrap::clamp, false});
  const Scene read = round_trip(written).scene;
  ASSERT_EQ(read.textures.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Texture &a = scene.textures[i], &b = read.textures[i];
    EXPECT_EQ(a.image, b.image);
    EXPECT_TRUE(a.wrap_u == b.wrap_u && a.wrap_v == b.wrap_v && a.nearest == b.nearest) << i;
  }
  EXPECT_EQ(read.images.at(0).encoded, scene.images[0].encoded);
  EXPECT_EQ(read.images.at(1).encoded, scene.images[1].encoded);
  EXPECT_EQ(read.images.at(1).mime, "image/webp");
  EXPECT_EQ(read.images.at(2).encoded, white_pixel_png());
}

TEST(BakedLook, PixelsAreDecodedWhereABaseColourNeedsThem) {
  BakedScene written = sphere_over_plane(1, 1, false);
  written.scene.images.push_back({"damaged", "image/png", {1, 2, 3}, 0, 0, {}});
  written.scene.textures.push_back({1, Wrap::repeat, Wrap::repeat, false});
  written.scene.materials[1].emission_texture.texture = 1;
  Scene read = round_trip(written).scene;
  decode_pixels(read);
  ASSERT_EQ(read.images[0].rgba.size(), 64u * 64 * 4);
  EXPECT_EQ(read.images[0].rgba[0], 235);
  EXPECT_EQ(read.images[0].rgba[4 * 40], 170);
  EXPECT_TRUE(read.images[1].rgba.empty());
}

TEST(BakedLook, LightsComeBackFromWorldUnits) {
  BakedScene written = sphere_over_plane(1, 1, false);
  written.scene.lights = {
      {LightType::directional, "sun", {3, 2, 1}, {0, 0, 0}, {0, -1, 0}, 0, 0, 0.7853982F},
      {LightType::point, "bulb", {0, 0.5F, 0}, {0.1F, 0.2F, -0.3F}, {0, 0, -1}, 0.25F, 0, 0.7853982F},
      {LightType::spot, "spot", {9, 9, 9}, {0.5F, 0, 0}, normalized(Vec3f{1, -2, 0.5F}), 0, 0.1F, 0.9F},
      {LightType::spot, "back", {1, 1, 1}, {0, 0, 0}, {0, 0, 1}, 0, 0, 0.5F}};
  const auto read = round_trip(written).scene.lights;
  ASSERT_EQ(read.size(), written.scene.lights.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    const Light &a = written.scene.lights[i], &b = read[i];
    EXPECT_TRUE(a.type == b.type && a.name == b.name) << i;
    const float few_ulp = 1e-6F;  // colour x intensity x scale^2 and back: a few float roundings
    EXPECT_LE(length(a.intensity - b.intensity), few_ulp * length(a.intensity)) << i;
    EXPECT_LE(length(a.position - b.position), few_ulp) << i;
    EXPECT_LE(length(a.direction - b.direction), few_ulp) << i;
    EXPECT_NEAR(a.range, b.range, few_ulp);
    EXPECT_EQ(b.outer_cone, a.type == LightType::spot ? a.outer_cone : Light{}.outer_cone);
  }
}

}  // namespace
}  // namespace kiln
