#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

/// One triangle with the material given as JSON, and more root members.
Result<Scene> import_material(const std::string& material, const std::string& root = {},
                              const std::map<std::string, Bytes>& resources = {}) {
  Sample s;
  s.positions(kTriangle);
  return import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0},\"material\":0") + ",\"materials\":[{" +
                            material + "}]" + (root.empty() ? "" : "," + root)),
                      resources);
}

const char* kTexture =
    "\"images\":[{\"uri\":\"a%20b.png\"}],\"textures\":[{\"source\":0,\"sampler\":0}],"
    "\"samplers\":[{\"wrapS\":33071,\"wrapT\":33648,\"magFilter\":9728}]";

TEST(ImportMaterials, FactorsAndModesAreTaken) {
  const auto scene = import_material(
      "\"name\":\"m\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.1,0.2,0.3,0.4],\"metallicFactor\":0.5,"
      "\"roughnessFactor\":0.25},"
      "\"emissiveFactor\":[1,0.5,0],\"alphaMode\":\"MASK\",\"alphaCutoff\":0.75,\"doubleSided\":true,"
      "\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":10},\"KHR_materials_unlit\":{}}");
  ASSERT_TRUE(scene) << scene.error().message;
  const Material& m = scene->materials[0];
  EXPECT_EQ(m.base_color, (Vec4f{0.1F, 0.2F, 0.3F, 0.4F}));
  EXPECT_EQ(m.emission, (Vec3f{10, 5, 0}));
  EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
  EXPECT_FLOAT_EQ(m.alpha_cutoff, 0.75F);
  EXPECT_TRUE(m.double_sided && m.unlit);
  EXPECT_FLOAT_EQ(m.metallic, 0.5F);
}

TEST(ImportMaterials, TexturesAreDecodedFromResourcesWithDecodedNames) {
  const auto scene = import_material("\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"texCoord\":1}}",
                                     kTexture, {{"a b.png", tiny_png()}});
  ASSERT_TRUE(scene) << scene.error().message << scene.error().where;
  const Image& image = scene->images[0];
  EXPECT_EQ(image.width, 2);
  EXPECT_EQ(image.rgba, (Bytes{255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255}));
  EXPECT_EQ(image.encoded, tiny_png());
  EXPECT_EQ(image.mime, "image/png");
  EXPECT_EQ(scene->materials[0].base_color_texture.uv_set, 1);
  EXPECT_EQ(scene->textures[0].wrap_u, Wrap::clamp);
  EXPECT_EQ(scene->textures[0].wrap_v, Wrap::mirror);
  EXPECT_TRUE(scene->textures[0].nearest);
}

TEST(ImportMaterials, TexturesThatNoDiffuseLightDependsOnStayEncoded) {
  const auto scene =
      import_material("\"normalTexture\":{\"index\":0,\"scale\":0.5}", kTexture, {{"a b.png", tiny_png()}});
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->images[0].rgba.empty());
  EXPECT_FALSE(scene->images[0].encoded.empty());
  EXPECT_FLOAT_EQ(scene->materials[0].normal_texture.scale, 0.5F);
}

TEST(ImportMaterials, ImagesMayStandInDataUrisAndBufferViews) {
  const std::string root =
      "\"images\":[{\"uri\":\"data:image/png;base64," + base64(tiny_png()) + "\"}],\"textures\":[{\"source\":0}]";
  const auto scene = import_material("\"emissiveFactor\":[1,1,1],\"emissiveTexture\":{\"index\":0}", root);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->images[0].rgba.size(), 16U);
}

TEST(ImportMaterials, TextureTransformScalesThenTurnsThenMoves) {
  const auto scene = import_material(
      "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"extensions\":{\"KHR_texture_transform\":"
      "{\"offset\":[0.25,0.5],\"scale\":[2,3],\"rotation\":1.5707963267948966,\"texCoord\":1}}}}",
      kTexture, {{"a b.png", tiny_png()}});
  ASSERT_TRUE(scene);
  const TextureRef& ref = scene->materials[0].base_color_texture;
  // Counter-clockwise by a quarter with v downwards: (u, v) -> (v, -u).
  const std::array<float, 6> want{0, 3, 0.25F, -2, 0, 0.5F};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(ref.transform[i], want[i], 1e-6) << i;
  EXPECT_EQ(ref.uv_set, 1);
}

TEST(ImportMaterials, OptionalUndecodableTexturesAreCarriedWithAWarning) {
  const Bytes ktx{0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, 0x0D, 0x0A, 0x1A, 0x0A, 0, 0, 0, 0};
  const auto scene = import_material(
      "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}",
      "\"images\":[{\"uri\":\"a.ktx2\"}],\"textures\":[{\"extensions\":{\"KHR_texture_basisu\":{\"source\":0}}}]",
      {{"a.ktx2", ktx}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(has_warning(*scene, "texture_not_decoded"));
  EXPECT_EQ(scene->images[0].encoded, ktx);
  EXPECT_TRUE(scene->images[0].rgba.empty());
}

TEST(ImportMaterials, UnknownRequiredExtensionsAreRefusedByNameAndOptionalOnesWarnedOf) {
  const auto required = import_material("", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\",\"ACME_fog\"]");
  ASSERT_FALSE(required);
  EXPECT_EQ(required.error().code, "unsupported_extension");
  EXPECT_NE(required.error().message.find("ACME_fog"), std::string::npos);
  EXPECT_EQ(required.error().where, "scene.glb: /extensionsRequired/1");
  const auto used = import_material("", "\"extensionsUsed\":[\"ACME_fog\"]");
  ASSERT_TRUE(used);
  EXPECT_TRUE(has_warning(*used, "extension_ignored"));
}

TEST(ImportMaterials, EveryWrongTypeNamesItsPointer) {
  const std::pair<const char*, const char*> cases[] = {
      {"\"doubleSided\":1", "/materials/0/doubleSided"},
      {"\"alphaCutoff\":\"x\"", "/materials/0/alphaCutoff"},
      {"\"emissiveFactor\":[1,2]", "/materials/0/emissiveFactor"},
      {"\"emissiveFactor\":[1,2,null]", "/materials/0/emissiveFactor/2"},
      {"\"pbrMetallicRoughness\":[]", "/materials/0/pbrMetallicRoughness"},
      {"\"normalTexture\":{\"index\":\"0\"}", "/materials/0/normalTexture/index"},
  };
  for (const auto& [material, pointer] : cases) {
    const auto scene = import_material(material, "\"textures\":[{}]");
    ASSERT_FALSE(scene) << material;
    EXPECT_EQ(scene.error().code, "json_type") << material;
    EXPECT_EQ(scene.error().where, std::string("scene.glb: ") + pointer);
  }
}

}  // namespace
}  // namespace kiln::test
