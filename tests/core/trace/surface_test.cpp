#include "core/trace/surface.h"

#include <gtest/gtest.h>

#include "tests/core/trace/test_scenes.h"

namespace kiln {
namespace {

using test::add_material;
using test::add_quad;
using test::add_texture;

/// One unit square in the plane y = 0, uv as drawn, with the given 2 x 1 texture of base colour.
Scene textured_square(Wrap wrap, bool nearest, std::vector<std::uint8_t> rgba = {0, 0, 0, 255, 255, 255, 255, 255}) {
  Scene scene;
  const int texture = add_texture(scene, 2, 1, std::move(rgba), wrap, nearest);
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {1, 1, 1}));
  scene.materials[0].base_color_texture.texture = texture;
  return scene;
}

float red(const Scene& scene, float u, float v = 0.5F) {
  return sample_texture(scene, scene.materials[0].base_color_texture, {u, v}, false).x;
}

TEST(Texture, NearestTakesTheTexelThatHoldsThePoint) {
  const Scene scene = textured_square(Wrap::clamp, true);
  EXPECT_EQ(red(scene, 0.01F), 0);
  EXPECT_EQ(red(scene, 0.49F), 0);
  EXPECT_EQ(red(scene, 0.51F), 1);
  EXPECT_EQ(red(scene, 0.99F), 1);
}

TEST(Texture, BilinearIsExactAtCentresAndLinearBetween) {
  const Scene scene = textured_square(Wrap::clamp, false);
  EXPECT_EQ(red(scene, 0.25F), 0);
  EXPECT_EQ(red(scene, 0.75F), 1);
  EXPECT_FLOAT_EQ(red(scene, 0.5F), 0.5F);
  EXPECT_FLOAT_EQ(red(scene, 0.375F), 0.25F);
}

TEST(Texture, WrapModesContinueTheImageAsGltfSays) {
  EXPECT_EQ(red(textured_square(Wrap::repeat, true), 1.25F), 0);
  EXPECT_EQ(red(textured_square(Wrap::repeat, true), -0.25F), 1);
  EXPECT_EQ(red(textured_square(Wrap::mirror, true), 1.25F), 1);
  EXPECT_EQ(red(textured_square(Wrap::mirror, true), 1.75F), 0);
  EXPECT_EQ(red(textured_square(Wrap::mirror, true), -0.25F), 0);
  EXPECT_EQ(red(textured_square(Wrap::clamp, true), 7.0F), 1);
  EXPECT_EQ(red(textured_square(Wrap::clamp, true), -7.0F), 0);
  EXPECT_FLOAT_EQ(red(textured_square(Wrap::repeat, false), 0), 0.5F);  // halfway to the neighbour round the corner
  EXPECT_FLOAT_EQ(red(textured_square(Wrap::mirror, false), 0), 0);     // the neighbour is its own image
}

TEST(Texture, HugeCoordinatesStayInsideTheImage) {
  for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
    for (const float u : {1e30F, -1e30F, 3e9F, -3e9F}) {
      const float value = red(textured_square(wrap, false), u, u);
      EXPECT_TRUE(value >= 0 && value <= 1);
    }
  }
}

TEST(Texture, TransformMovesAndTurnsTheImage) {
  Scene scene = textured_square(Wrap::clamp, true);
  scene.materials[0].base_color_texture.transform = {0, 1, 0, -1, 0, 1};  // u' = v, v' = 1 - u
  EXPECT_EQ(red(scene, 0.5F, 0.1F), 0);
  EXPECT_EQ(red(scene, 0.5F, 0.9F), 1);
  scene.materials[0].base_color_texture.transform = {1, 0, 0.5F, 0, 1, 0};
  EXPECT_EQ(red(scene, 0.25F), 1);
}

TEST(Texture, SrgbIsDecodedInColourAndNotInAlpha) {
  const Scene scene = textured_square(Wrap::clamp, true, {128, 10, 255, 128, 128, 10, 255, 128});
  const Vec4f texel = sample_texture(scene, scene.materials[0].base_color_texture, {0.1F, 0.5F}, true);
  EXPECT_NEAR(texel.x, 0.215861, 1e-6);  // ((128/255 + .055) / 1.055)^2.4
  EXPECT_NEAR(texel.y, 0.003035, 1e-6);  // 10/255/12.92
  EXPECT_EQ(texel.z, 1);
  EXPECT_FLOAT_EQ(texel.w, 128.0F / 255);
}

TEST(Texture, WithoutPixelsItIsWhite) {
  Scene scene = textured_square(Wrap::clamp, true);
  scene.images[0].rgba.clear();
  EXPECT_EQ(red(scene, 0.1F), 1);
  EXPECT_EQ(sample_texture(scene, TextureRef{}, {0, 0}, true), (Vec4f{1, 1, 1, 1}));
}

TEST(Surface, PointInterpolatesPositionAndNormal) {
  Scene scene;
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {1, 1, 1}));
  scene.mesh.normal[1] = normalized(Vec3f{0, 1, 1});
  const SurfacePoint p = surface_point(scene, 0, 0.5F, 0);
  EXPECT_EQ(p.position, (Vec3f{-0.5F, 0, 0}));
  EXPECT_EQ(p.geometric_normal, (Vec3f{0, 1, 0}));
  const Vec3f expected = normalized(Vec3f{0, 1, 0} + normalized(Vec3f{0, 1, 1}));
  EXPECT_NEAR(length(p.normal - expected), 0, 1e-6);
}

TEST(Surface, NormalIsBroughtToTheFrontOfItsFace) {
  Scene scene;
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {1, 1, 1}));
  for (Vec3f& n : scene.mesh.normal) n = normalized(Vec3f{0.6F, -0.8F, 0});
  const SurfacePoint p = surface_point(scene, 0, 0.2F, 0.3F);
  EXPECT_NEAR(length(p.normal - Vec3f{0.6F, 0.8F, 0}), 0, 1e-6);
}

TEST(Surface, DegenerateTrianglesStillHaveUnitNormals) {
  Scene scene;
  add_quad(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, add_material(scene, {1, 1, 1}));
  scene.mesh.position.assign(4, {0.1F, 0.2F, 0.3F});
  for (const Vec3f& n : {Vec3f{0, 1, 0}, Vec3f{0, 0, 0}}) {
    scene.mesh.normal.assign(4, n);
    const SurfacePoint p = surface_point(scene, 0, 0.3F, 0.3F);
    EXPECT_FLOAT_EQ(length(p.normal), 1);
    EXPECT_FLOAT_EQ(length(p.geometric_normal), 1);
  }
}

TEST(Surface, NeedlesKeepTheirFaceNormal) {
  Scene scene;
  add_quad(scene, {0, 0, 0}, {0, 0, 1e-20F}, {1e-20F, 0, 0}, add_material(scene, {1, 1, 1}));
  for (Vec3f& n : scene.mesh.normal) n = {1, 0, 0};
  EXPECT_EQ(surface_point(scene, 0, 0.3F, 0.3F).geometric_normal, (Vec3f{0, 1, 0}));
}

TEST(Surface, AlbedoIsFactorTimesTextureTimesVertexColourAndStaysBelowOne) {
  Scene scene = textured_square(Wrap::clamp, true, {255, 255, 255, 255, 255, 255, 255, 255});
  scene.materials[0].base_color = {0.5F, 2, 1, 1};
  scene.mesh.color.assign(4, {0.5F, 1, 0.25F, 1});
  EXPECT_EQ(albedo_at(scene, surface_point(scene, 0, 0.2F, 0.2F)), (Vec3f{0.5F, 0.999F, 0.999F}));  // no has_color
  scene.parts[0].has_color = true;
  const Vec3f albedo = albedo_at(scene, surface_point(scene, 0, 0.2F, 0.2F));
  EXPECT_FLOAT_EQ(albedo.x, 0.25F);
  EXPECT_FLOAT_EQ(albedo.y, 0.999F);
  EXPECT_FLOAT_EQ(albedo.z, 0.25F);
}

TEST(Surface, EmissionIsScaledByItsTexture) {
  Scene scene = textured_square(Wrap::clamp, true);
  scene.materials[0].emission = {10, 20, 30};
  EXPECT_EQ(emission_at(scene, surface_point(scene, 0, 0.2F, 0.2F)), (Vec3f{10, 20, 30}));
  scene.materials[0].emission_texture.texture = 0;
  // Corner 1 of triangle 0 is at uv (1, 0), in the white texel; corner 0 in the black one.
  EXPECT_EQ(emission_at(scene, surface_point(scene, 0, 0.9F, 0)), (Vec3f{10, 20, 30}));
  EXPECT_EQ(emission_at(scene, surface_point(scene, 0, 0.1F, 0)), (Vec3f{}));
}

TEST(Surface, OpacityFollowsTheAlphaMode) {
  Scene scene = textured_square(Wrap::clamp, true, {255, 255, 255, 100, 255, 255, 255, 200});
  const SurfacePoint thin = surface_point(scene, 0, 0.1F, 0), thick = surface_point(scene, 0, 0.9F, 0);
  EXPECT_EQ(opacity_at(scene, thin), 1);
  scene.materials[0].alpha_mode = AlphaMode::mask;
  EXPECT_EQ(opacity_at(scene, thin), 0);
  EXPECT_EQ(opacity_at(scene, thick), 1);
  scene.materials[0].alpha_mode = AlphaMode::blend;
  EXPECT_FLOAT_EQ(opacity_at(scene, thin), 100.0F / 255);
}

}  // namespace
}  // namespace kiln
