#include "core/bake/normal_maps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/artifact/png.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

/// A plane whose material has a map of one texel.
Scene mapped(std::uint8_t r, std::uint8_t g, std::uint8_t b, float scale) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, -0.5F}, {0, 0, 1}, {1, 0, 0}, 4, 4);
  for (const Vec3f& p : scene.mesh.position) scene.mesh.uv0.push_back({p.x, p.z});
  const std::vector<std::uint8_t> texel{r, g, b};
  Image image;
  image.encoded = write_png({1, 1, 3}, texel);
  scene.images.push_back(image);
  scene.textures.push_back({.image = 0});
  Material& m = scene.materials[static_cast<std::size_t>(scene.parts[0].material)];
  m.normal_texture.texture = 0, m.normal_texture.scale = scale;
  return scene;
}

TEST(NormalMaps, AreFoundWithTheAngleThatTheyTiltBy) {
  // (.6, 0, .8) is a slope of .75; bytes are steps of 2 / 255, half of one is .3 degrees there.
  const auto tilted = find_normal_maps(mapped(204, 128, 230, 1));
  ASSERT_TRUE(tilted);
  EXPECT_EQ(tilted->materials.size(), 1U);
  EXPECT_NEAR(tilted->degrees, std::atan(0.75) * 180 / std::acos(-1.0), 0.4);
  EXPECT_NEAR(find_normal_maps(mapped(204, 128, 230, 0.5F))->degrees, std::atan(0.375) * 180 / std::acos(-1.0), 0.4);
  EXPECT_LT(find_normal_maps(mapped(128, 128, 255, 1))->degrees, 0.4);
}

TEST(NormalMaps, NoneAndThoseThatCannotBeReadAreNoMistake) {
  Scene scene = mapped(204, 128, 230, 1);
  scene.images[0].encoded.resize(20);
  const auto broken = find_normal_maps(scene);
  ASSERT_TRUE(broken);
  EXPECT_EQ(broken->degrees, 0);
  scene.materials[static_cast<std::size_t>(scene.parts[0].material)].normal_texture.texture = -1;
  EXPECT_FALSE(find_normal_maps(scene));
}

}  // namespace
}  // namespace kiln
