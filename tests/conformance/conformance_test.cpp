// Every conformance asset imports with the triangles that its manifest counts, or is refused for a true reason.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/conformance/shared_models.h"

namespace kiln::test {
namespace {

struct Asset {
  const char* file;
  std::size_t triangles;     // as MANIFEST.md, instances expanded; 0 if refused
  const char* code = "";     // of the refusal
  const char* warning = "";  // one that must be there
};

const Asset kAssets[] = {
    {"01_single_vs_double_sided/01_single_vs_double_sided.gltf", 1480},
    {"01_vertex_count_16bit/01_vertex_count_16bit.gltf", 130378, "", "winding_contradicts_normals"},
    {"02_node_hierarchy/02_node_hierarchy.gltf", 60},
    {"14_emission_strength/14_emission_strength.gltf", 17280, "", "specular_glossiness_as_diffuse"},
    {"24_gpu_instancing/24_gpu_instancing.gltf", 7656770},
    {"AlphaBlendModeTest/AlphaBlendModeTest.glb", 61},
    {"AnimatedMorphCube/AnimatedMorphCube.gltf", 12, "", "morph_rest_pose"},
    {"BoxDraco/BoxDraco.gltf", 12},
    {"BoxInterleaved/BoxInterleaved.glb", 12},
    {"BoxMeshopt/BoxMeshopt.gltf", 12},
    {"CesiumBalloonKTX2/CesiumBalloonKTX2.glb", 0, "unsupported_extension"},
    {"CesiumMan/CesiumMan.glb", 4672, "", "skin_rest_pose"},
    {"Mesh_PrimitiveMode/Mesh_PrimitiveMode_00.gltf", 0, "empty_scene"},  // points
    {"Mesh_PrimitiveMode/Mesh_PrimitiveMode_02.gltf", 0, "empty_scene"},  // a line loop
    {"Mesh_PrimitiveMode/Mesh_PrimitiveMode_04.gltf", 2},
    {"Mesh_PrimitiveMode/Mesh_PrimitiveMode_08.gltf", 0, "empty_scene"},  // lines
    {"Mesh_PrimitiveMode/Mesh_PrimitiveMode_12.gltf", 2},
    {"Mesh_PrimitiveMode/Mesh_PrimitiveMode_14.gltf", 2},
    {"MorphPrimitivesTest/MorphPrimitivesTest.gltf", 32, "", "morph_rest_pose"},
    {"MultiUVTest/MultiUVTest.gltf", 12},
    {"PalmTree/PalmTree.gltf", 10124},
    {"SimpleSparseAccessor/SimpleSparseAccessor.gltf", 12},
    {"SpheresScaledInstances/spheres_scaled_instances.gltf", 672},
    {"TextureTransformTest/TextureTransformTest.gltf", 24},
    {"TriangleWithoutIndices/TriangleWithoutIndices.gltf", 1},
    {"UnlitTest/UnlitTest.gltf", 88, "", "unlit_as_diffuse"},
    {"VertexColorTest/VertexColorTest.gltf", 36},
    {"embedded/BoxTextured.gltf", 12},
    {"multi-scene/scene.gltf", 0, "unknown_enum"},  // a light of type "ambient", which the extension does not have
    {"simple_skin/simple_skin.gltf", 8, "", "skin_rest_pose"},
    {"sphere_lights/sphere_lights.gltf", 224},
    {"unicode/Unicode \xE2\x9D\xA4\xE2\x99\xBB Test.gltf", 2},
};

class Conformance : public testing::TestWithParam<Asset> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(shared_models() / "conformance")) GTEST_SKIP() << "the shared models are not here";
  }
};

TEST_P(Conformance, ImportsOrIsRefusedForATrueReason) {
  const Asset& asset = GetParam();
  const auto scene = import_shared("conformance/" + std::string(asset.file));
  if (asset.triangles == 0) {
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, asset.code) << scene.error().message;
    return;
  }
  ASSERT_TRUE(scene) << scene.error().code << ": " << scene.error().message << " " << scene.error().where;
  EXPECT_EQ(scene->mesh.triangles.size(), asset.triangles);
  const auto is_wanted = [&](const Warning& w) { return w.code == asset.warning; };
  if (*asset.warning != '\0') {
    EXPECT_TRUE(std::any_of(scene->warnings.begin(), scene->warnings.end(), is_wanted));
  }
  for (const Vec3f& n : scene->mesh.normal) ASSERT_NEAR(dot(n, n), 1, 1e-5);
}

std::string test_name(const testing::TestParamInfo<Asset>& info) {
  std::string name = std::filesystem::path(info.param.file).stem().string();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, Conformance, testing::ValuesIn(kAssets), test_name);

TEST(ConformanceDetails, SphereLightsHasFourLightsWithTheirDefaults) {
  const auto scene = import_shared("conformance/sphere_lights/sphere_lights.gltf");
  if (!std::filesystem::exists(shared_models())) GTEST_SKIP() << "the shared models are not here";
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->lights.size(), 4U);
}

TEST(ConformanceDetails, CompressedBoxesHaveTheBoundsOfTheManifest) {
  if (!std::filesystem::exists(shared_models())) GTEST_SKIP() << "the shared models are not here";
  for (const char* file : {"conformance/BoxDraco/BoxDraco.gltf", "conformance/BoxMeshopt/BoxMeshopt.gltf",
                           "conformance/BoxInterleaved/BoxInterleaved.glb"}) {
    const auto scene = import_shared(file);
    ASSERT_TRUE(scene);
    EXPECT_NEAR(scene->frame.scale, 1, 1e-4) << file;
    EXPECT_NEAR(length(scene->frame.center), 0, 1e-4) << file;
  }
}

TEST(ConformanceDetails, EmissionStrengthMultipliesTheFactor) {
  const auto scene = import_shared("conformance/14_emission_strength/14_emission_strength.gltf");
  if (!std::filesystem::exists(shared_models())) GTEST_SKIP() << "the shared models are not here";
  ASSERT_TRUE(scene);
  float brightest = 0;
  for (const Material& m : scene->materials) brightest = std::max(brightest, m.emission.x);
  EXPECT_GT(brightest, 1) << "some material is stronger than any factor";
}

/// The markers of TextureTransformTest show where the tip of an arrow along the diagonal u = v must come to lie.
TEST(ConformanceDetails, TextureTransformsTurnTheWayThatTheTestAssetShows) {
  if (!std::filesystem::exists(shared_models())) GTEST_SKIP() << "the shared models are not here";
  const auto scene = import_shared("conformance/TextureTransformTest/TextureTransformTest.gltf");
  ASSERT_TRUE(scene);
  const auto rotation = std::find_if(scene->materials.begin(), scene->materials.end(),
                                     [](const Material& m) { return m.name == "Rotation"; });
  ASSERT_NE(rotation, scene->materials.end());
  // The green marker, at (-0.079, -0.516) beside the middle of the quad.
  const float u = 0.5F - 0.07904822F, v = 0.5F + 0.51626749F;
  const auto& m = rotation->base_color_texture.transform;
  EXPECT_NEAR(m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5], 1e-5);
}

struct RealScene {
  const char* file;
  std::size_t triangles;
};

TEST(ConformanceDetails, RealScenesHaveTheTrianglesOfTheManifestWithoutTheUselessOnes) {
  if (!std::filesystem::exists(shared_models() / "scenes")) GTEST_SKIP() << "the shared models are not here";
  // Useless ones, as the warnings count them: 927 of 32397 in the dungeon, 76 of 99029 in the hotel room, 3 of the
  // buddha, 4 of the original Cornell box.
  const RealScene scenes[] = {{"bunny/bunny.glb", 144046},
                              {"bunny/bun_zipper.ply", 69451},
                              {"cornell-box/CornellBox-Original.glb", 32},
                              {"cornell-box-gltf/CornellBox.glb", 36},
                              {"dungeon-interior/level-dungeon.gltf", 31470},
                              {"hotel-room/scene.glb", 98953},
                              {"mixed-lighting/MixedLightingExample.gltf", 40898},
                              {"irradiance-volume/IrradianceVolumeExample.glb", 32},
                              {"damaged-helmet/DamagedHelmet.glb", 15452},
                              {"lantern/Lantern.gltf", 5394},
                              {"buddha/buddha.glb", 99997}};
  for (const RealScene& real : scenes) {
    const auto scene = import_shared(std::string("scenes/") + real.file);
    ASSERT_TRUE(scene) << real.file << " " << scene.error().message;
    EXPECT_EQ(scene->mesh.triangles.size(), real.triangles) << real.file;
  }
}

TEST(ConformanceDetails, RealEnvironmentsAreReadAndTheirMeanIsTheirFirstCoefficient) {
  if (!std::filesystem::exists(shared_models() / "environments")) GTEST_SKIP() << "the shared models are not here";
  for (const char* name : {"spiaggia_di_mondello_1k.hdr", "st_peters_square_night_1k.hdr", "courtyard.exr"}) {
    const auto files = read_scene_files((shared_models() / "environments" / name).string());
    ASSERT_TRUE(files);
    const auto e = import_environment(files->main, files->name);
    ASSERT_TRUE(e) << e.error().message;
    EXPECT_EQ(e->width, 1024);
    // Texel solid angles against the integral of the bilinear map: they differ by one part in a thousand at most.
    double sum = 0;
    for (std::size_t j = 0; j < 512; ++j) {
      const double area =
          2 * M_PI / 1024 *
          (std::cos(M_PI * static_cast<double>(j) / 512) - std::cos(M_PI * (static_cast<double>(j) + 1) / 512));
      for (std::size_t i = 0; i < 1024; ++i) sum += area * static_cast<double>(e->radiance[j * 1024 + i].y);
    }
    const double first = static_cast<double>(project_environment(*e, 1)[0].y) * 2 * std::sqrt(M_PI);
    EXPECT_NEAR(first / sum, 1, 1e-3) << name;
  }
}

}  // namespace
}  // namespace kiln::test
