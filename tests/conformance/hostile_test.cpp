// Every broken file gets the fault that tells what is wrong with it, quickly and in little memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <fstream>

#include "tests/conformance/shared_models.h"
#include "tests/core/artifact/peak_memory.h"

namespace kiln::test {
namespace {

struct Broken {
  const char* file;
  const char* code;  // of the fault, or of the warning if the file is merely ugly
  bool ugly = false;
};

const Broken kFiles[] = {
    {"assimp/BoxWithInfinites.glb", "non_finite_geometry"},
    {"assimp/IndexOutOfRange.gltf", "index_out_of_range"},
    {"assimp/MissingBin/BoxTextured.gltf", "resource_missing"},
    {"assimp/RecursiveNodes.gltf", "node_cycle"},
    {"assimp/wrongTypes/badNumber.gltf", "json_type"},
    {"cesium/cubeQuantized.glb", "quantization_not_declared", true},
    {"cesium/cubeSomeBadIndices.glb", "index_out_of_range"},
    {"draco/inf_nan.obj", "unknown_format"},
    {"magnum/buffer-invalid-short-size.glb", "buffer_too_short"},
    {"magnum/ply-incomplete-face-specification.ply", "ply_truncated"},
    {"magnum/scene-invalid-cycle.gltf", "node_cycle"},
    {"obj/malformed.obj", "unknown_format"},
    {"tinygltf/integer-out-of-bounds.gltf", "json_type"},
    {"tinygltf/invalid-buffer-view-index.gltf", "index_out_of_range"},
    {"validator/accessor/invalid_sparse_count_and_stride.gltf", "accessor_sparse_count"},
    {"validator/accessor_data/out_of_range_elements_float.gltf",
     "empty_scene"},  // bounds that lie, of data that nothing uses
    {"validator/asset/1_0_version.gltf", "unsupported_version"},
    {"validator/buffer/invalid_uri_data.gltf", "data_uri_invalid"},
    {"validator/buffer/non_relative_uri.gltf", "external_uri_forbidden"},
    {"validator/buffer/wrong_bytelength.glb", "buffer_too_short"},
    {"validator/buffer_view/invalid_length.gltf", "view_out_of_bounds"},
    {"validator/glb/chunk_too_big.glb", "glb_length_mismatch"},
    {"validator/glb/empty_file.glb", "empty_file"},
    {"validator/glb/invalid_magic.glb", "unknown_format"},
    {"validator/glb/length_mismatch.glb", "glb_length_mismatch"},
    {"validator/glb/misplaced_bin_chunk.glb", "glb_chunk_order"},
    {"validator/glb/truncated_chunk_data.glb", "glb_length_mismatch"},
    {"validator/glb/two_bin_chunks.glb", "glb_chunk_order"},
    {"validator/image/invalid_image_data.gltf", "image_type"},
    {"validator/json/bom.gltf", "empty_scene"},
    {"validator/json/invalid_syntax.gltf", "json_invalid"},
    {"validator/mesh/accessor_unequal_count.gltf", "attribute_count_mismatch"},
    {"validator/mesh/primitive_no_position.gltf", "empty_scene"},
    {"validator/mesh_data/index_buffer_oob.gltf", "index_out_of_range"},
    {"validator/node/infinite_transform.gltf", "number_out_of_range"},
    {"validator/node/node_loop.gltf", "node_cycle"},
    {"xatlas/duplicate_edge.obj", "unknown_format"},
    {"xatlas/zero_area_face.obj", "unknown_format"},
};

class HostileFile : public testing::TestWithParam<Broken> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(shared_models() / "hostile")) GTEST_SKIP() << "the shared models are not here";
  }
};

TEST_P(HostileFile, IsAnsweredByItsFault) {
  const Broken& broken = GetParam();
  reset_peak_memory();
  const std::uint64_t before = peak_memory_bytes();
  const std::clock_t start = std::clock();
  const auto scene = import_shared("hostile/" + std::string(broken.file));
  EXPECT_LT(std::clock() - start, 5 * CLOCKS_PER_SEC);  // of the processor: the machine may be shared
  EXPECT_LT(peak_memory_bytes(), before + (200u << 20));
  ASSERT_EQ(scene.has_value(), broken.ugly);
  if (broken.ugly) {
    EXPECT_TRUE(std::any_of(scene->warnings.begin(), scene->warnings.end(),
                            [&](const Warning& w) { return w.code == broken.code; }));
    return;
  }
  EXPECT_EQ(scene.error().code, broken.code) << scene.error().message;
  EXPECT_EQ(scene.error().where.rfind(std::filesystem::path(broken.file).filename().string(), 0), 0U);
  EXPECT_EQ((scene.error().message + scene.error().where).find(KILN_SHARED), std::string::npos);
}

std::string test_name(const testing::TestParamInfo<Broken>& info) {
  std::string name = info.param.file;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, HostileFile, testing::ValuesIn(kFiles), test_name);

TEST(HostileFiles, TheTableLeavesNoneOut) {
  if (!std::filesystem::exists(shared_models() / "hostile")) GTEST_SKIP() << "the shared models are not here";
  std::size_t found = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(shared_models() / "hostile")) {
    const auto kind = entry.path().extension();
    found += kind == ".gltf" || kind == ".glb" || kind == ".ply" || kind == ".obj" ? 1 : 0;
  }
  EXPECT_EQ(found, std::size(kFiles));
}

}  // namespace
}  // namespace kiln::test
