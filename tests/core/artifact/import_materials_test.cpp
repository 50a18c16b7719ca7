#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

// libjpeg's header needs FILE and size_t before it.
#include <jpeglib.h>

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

/// The first pixel of a picture that stands for a base colour.
std::array<int, 4> first_pixel(const Bytes& file) {
  const auto scene =
      import_material("\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}", kTexture, {{"a b.png", file}});
  if (!scene) {
    ADD_FAILURE() << scene.error().message;
    return {};
  }
  const Bytes& rgba = scene->images[0].rgba;
  return {rgba[0], rgba[1], rgba[2], rgba[3]};
}

Bytes one_pixel_png(std::uint8_t depth, std::uint8_t type, const Bytes& pixel,
                    const std::vector<std::pair<std::string, Bytes>>& chunks = {}) {
  Bytes png = png_header_only(1, 1);
  png.resize(8);
  append_png_chunk(png, "IHDR", {0, 0, 0, 1, 0, 0, 0, 1, depth, type, 0, 0, 0});
  for (const auto& [name, data] : chunks) append_png_chunk(png, name, data);
  Bytes row(1 + pixel.size());
  std::copy(pixel.begin(), pixel.end(), row.begin() + 1);
  append_png_chunk(png, "IDAT", zlib_stored(row));
  append_png_chunk(png, "IEND", {});
  return png;
}

TEST(ImportMaterials, PngOfEveryKindBecomesEightBitsWithoutItsGamma) {
  using Pixel = std::array<int, 4>;
  const std::vector<std::pair<std::string, Bytes>> palette{{"PLTE", {1, 2, 3, 40, 50, 60}}, {"tRNS", {255, 7}}};
  EXPECT_EQ(first_pixel(one_pixel_png(1, 3, {0x80}, palette)), (Pixel{40, 50, 60, 7}));
  EXPECT_EQ(first_pixel(one_pixel_png(2, 0, {0x40})), (Pixel{85, 85, 85, 255}));
  EXPECT_EQ(first_pixel(one_pixel_png(8, 4, {9, 8})), (Pixel{9, 9, 9, 8}));
  EXPECT_EQ(first_pixel(one_pixel_png(8, 2, {9, 8, 7}, {{"gAMA", {0, 1, 0x86, 0xA0}}})), (Pixel{9, 8, 7, 255}));
  EXPECT_EQ(first_pixel(one_pixel_png(8, 2, {9, 8, 7}, {{"tRNS", {0, 9, 0, 8, 0, 7}}})), (Pixel{9, 8, 7, 0}));
  // round(x / 257): 0x1080 / 257 = 16.44, 0x10FF / 257 = 16.93.
  EXPECT_EQ(first_pixel(one_pixel_png(16, 6, {0x10, 0x80, 0x10, 0xFF, 0x80, 0x80, 0xFF, 0xFF})),
            (Pixel{16, 17, 128, 255}));
}

/// 16 x 8 pixels of one colour; of inks as Adobe stores them, 255 for none. `exif` goes in front of the tables.
Bytes flat_jpeg(J_COLOR_SPACE space, const std::array<std::uint8_t, 4>& colour, const Bytes& exif = {}) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &out, &size);
  info.image_width = 16;
  info.image_height = 8;
  info.input_components = space == JCS_RGB ? 3 : 4;
  info.in_color_space = space == JCS_RGB ? JCS_RGB : JCS_CMYK;
  jpeg_set_defaults(&info);
  if (space != JCS_RGB) jpeg_set_colorspace(&info, space);
  jpeg_set_quality(&info, 100, TRUE);
  jpeg_start_compress(&info, TRUE);
  if (!exif.empty()) jpeg_write_marker(&info, JPEG_APP0 + 1, exif.data(), static_cast<unsigned>(exif.size()));
  std::vector<JSAMPLE> row;
  for (int x = 0; x < 16; ++x) row.insert(row.end(), colour.begin(), colour.begin() + info.input_components);
  for (JSAMPROW line = row.data(); info.next_scanline < 8;) jpeg_write_scanlines(&info, &line, 1);
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  Bytes file(out, out + size);
  std::free(out);
  return file;
}

TEST(ImportMaterials, JpegOfInksIsTheColourOfTheirPrint) {
  // No ink but half of the black: (200, 100, 50) / 255 of what is left of white under black, 128 / 255.
  const auto near = [](const std::array<int, 4>& got, const std::array<int, 4>& want) {
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(got[c], want[c], 2) << c;  // the rounding of JPEG itself
  };
  near(first_pixel(flat_jpeg(JCS_YCCK, {200, 100, 50, 128})), {100, 50, 25, 255});
  // libjpeg leaves Adobe's marker with both; without it ink is stored upright.
  Bytes upright = flat_jpeg(JCS_CMYK, {200, 100, 50, 128});
  near(first_pixel(upright), {100, 50, 25, 255});
  const std::string adobe = "Adobe";
  const auto at = std::search(upright.begin(), upright.end(), adobe.begin(), adobe.end());
  ASSERT_NE(at, upright.end());
  *at = 'a';
  near(first_pixel(upright), {55 * 127 / 255, 155 * 127 / 255, 205 * 127 / 255, 255});
}

/// glTF 2.0, 3.8.2: whatever Exif says of orientation is ignored. Here it would turn by a quarter.
TEST(ImportMaterials, JpegIsNotTurnedByExif) {
  Bytes exif{'E', 'x', 'i', 'f', 0, 0};
  append_bytes(exif, {'M', 'M', 0, 42, 0, 0, 0, 8, 0, 1, 1, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0, 0, 0, 0, 0});
  const auto scene = import_material("\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}", kTexture,
                                     {{"a b.png", flat_jpeg(JCS_RGB, {200, 100, 50, 0}, exif)}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->images[0].width, 16);
  EXPECT_EQ(scene->images[0].height, 8);
  EXPECT_EQ(scene->images[0].rgba.size(), 16U * 8 * 4);
}

TEST(ImportMaterials, SimplerMaterialsAreSaidSo) {
  for (const auto& [name, code] : {std::pair{"KHR_materials_ior", "reflectance_ignored"},
                                   {"KHR_materials_specular", "reflectance_ignored"},
                                   {"KHR_materials_pbrSpecularGlossiness", "specular_glossiness_as_diffuse"},
                                   {"KHR_materials_transmission", "extension_ignored"}}) {
    const auto scene = import_material("", std::string("\"extensionsUsed\":[\"") + name + "\"]");
    ASSERT_TRUE(scene) << name;
    EXPECT_TRUE(has_warning(*scene, code)) << name;
  }
  const auto unlit = import_material("\"extensions\":{\"KHR_materials_unlit\":{}}",
                                     "\"extensionsRequired\":[\"KHR_materials_unlit\",\"KHR_materials_ior\"]");
  ASSERT_TRUE(unlit);
  EXPECT_TRUE(has_warning(*unlit, "unlit_as_diffuse"));
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
