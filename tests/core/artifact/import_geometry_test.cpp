// Forms of geometry that glTF knows, and what a bake makes of them.
#include <gtest/gtest.h>

#include <cmath>

#include "core/mesh/topology.h"
#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

Vec3d world(const Scene& scene, std::size_t vertex) {
  return scene.frame.to_world(to_double(scene.mesh.position[vertex]));
}

/// Signed volume of the mesh in unit lengths: positive when the winding is outwards.
double volume(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    sum +=
        dot(to_double(mesh.position[t[0]]), cross(to_double(mesh.position[t[1]]), to_double(mesh.position[t[2]]))) / 6;
  }
  return sum;
}

Result<Scene> import_cube(const std::string& node) {
  Sample s;
  const int p = s.positions(cube_positions()), i = s.indices(cube_indices());
  return import_bytes(s.glb(
      one_node("\"attributes\":{\"POSITION\":" + std::to_string(p) + "},\"indices\":" + std::to_string(i), node)));
}

TEST(ImportGeometry, ATriangleComesOutInTheUnitCubeAndTheFrameLeadsBack) {
  Sample s;
  s.positions({5, 6, 7, 9, 6, 7, 5, 8, 7});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->mesh.triangles.size(), 1U);
  EXPECT_EQ(scene->mesh.position[0], (Vec3f{-0.5F, -0.25F, 0}));
  EXPECT_NEAR(length(world(*scene, 1) - Vec3d{9, 6, 7}), 0, 1e-6);
  EXPECT_EQ(scene->mesh.normal[0], (Vec3f{0, 0, 1}));
  EXPECT_EQ(scene->materials.size(), 1U);
  EXPECT_TRUE(scene->mesh.uv0.empty());
}

TEST(ImportGeometry, MissingNormalsAreFlatSoVerticesAreUnshared) {
  const auto scene = import_cube("");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->mesh.position.size(), 36U);
  for (const Triangle& t : scene->mesh.triangles) {
    const Vec3f face = normalized(area_vector(scene->mesh, t));
    for (const std::uint32_t v : t) EXPECT_NEAR(dot(face, scene->mesh.normal[v]), 1, 1e-6);
  }
}

TEST(ImportGeometry, AMirroringNodeTurnsTheWinding) {
  const auto plain = import_cube(""), mirrored = import_cube("\"scale\":[-1,1,1]");
  ASSERT_TRUE(plain && mirrored);
  EXPECT_NEAR(volume(plain->mesh), 1, 1e-6);
  EXPECT_NEAR(volume(mirrored->mesh), 1, 1e-6);
}

TEST(ImportGeometry, NormalsFollowTheInverseTranspose) {
  // A slope along (1, 1, 0) stretched by 2 in x: its normal becomes (1/2, 1, 0), normalised.
  Sample s;
  const float h = std::sqrt(0.5F);
  s.positions({0, 1, 0, 0, 1, 1, 1, 0, 0});
  s.normals({h, h, 0, h, h, 0, h, h, 0});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0,\"NORMAL\":1}", "\"scale\":[2,1,1]")));
  ASSERT_TRUE(scene);
  EXPECT_NEAR(length(scene->mesh.normal[0] - normalized(Vec3f{0.5F, 1, 0})), 0, 1e-6);
}

TEST(ImportGeometry, StripsAndFansKeepTheirOrientation) {
  // A unit square in z = 0 facing +Z, as strip and as fan.
  const std::vector<float> strip{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, fan{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  for (const auto& [mode, positions] : {std::pair{5, strip}, {6, fan}}) {
    Sample s;
    s.positions(positions);
    const auto scene =
        import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0},\"mode\":" + std::to_string(mode))));
    ASSERT_TRUE(scene);
    ASSERT_EQ(scene->mesh.triangles.size(), 2U);
    for (const Vec3f& n : scene->mesh.normal) EXPECT_EQ(n, (Vec3f{0, 0, 1})) << mode;
    EXPECT_NEAR(surface_area(scene->mesh), 1, 1e-6);
  }
}

TEST(ImportGeometry, SparseElementsReplaceOthersAlsoWithoutAView) {
  Sample s;
  const auto index_at = s.blob().add(std::vector<std::uint16_t>{1, 2});
  const auto value_at = s.blob().add(std::vector<float>{2, 0, 0, 0, 4, 0});
  s.add_view(index_at, 4);
  s.add_view(value_at, 24);
  s.add_accessor(
      "\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"sparse\":{\"count\":2,"
      "\"indices\":{\"bufferView\":0,\"componentType\":5123},\"values\":{\"bufferView\":1}}");
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(length(world(*scene, 1) - Vec3d{2, 0, 0}), 0, 1e-6);
  EXPECT_NEAR(length(world(*scene, 2) - Vec3d{0, 4, 0}), 0, 1e-6);
}

TEST(ImportGeometry, NormalisedIntegersAndStridesAreReadAsTheSpecificationSays) {
  Sample s;
  s.positions(kTriangle);
  // Unsigned bytes with a stride of 8: RGBA, then four bytes that are none of ours.
  s.accessor<std::uint8_t>({255, 0, 51, 255, 9, 9, 9, 9, 0, 0, 0, 0, 9, 9, 9, 9, 0, 0, 0, 0, 9, 9, 9, 9}, 5121, "VEC4",
                           3, ",\"normalized\":true", 8);
  s.accessor<std::uint16_t>({65535, 0, 0, 13107, 0, 0}, 5123, "VEC2", 3, ",\"normalized\":true");
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0,\"COLOR_0\":1,\"TEXCOORD_0\":2}")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_FLOAT_EQ(scene->mesh.color[0].x, 1);
  EXPECT_FLOAT_EQ(scene->mesh.color[0].z, 0.2F);
  EXPECT_FLOAT_EQ(scene->mesh.uv0[0].x, 1);
  EXPECT_FLOAT_EQ(scene->mesh.uv0[1].y, 0.2F);
  EXPECT_TRUE(scene->parts[0].has_color && scene->parts[0].has_uv0 && !scene->parts[0].has_uv1);
}

TEST(ImportGeometry, QuantizedPositionsAreReadAndWarnedOfWhenNotDeclared) {
  Sample s;
  s.accessor<std::int16_t>({0, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0, 0}, 5122, "VEC3", 3, "", 8);
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(length(world(*scene, 1) - Vec3d{100, 0, 0}), 0, 1e-4);
  EXPECT_TRUE(has_warning(*scene, "quantization_not_declared"));
}

TEST(ImportGeometry, PrimitivesAreSeparatePartsWithSeparateVertices) {
  Sample s;
  s.positions(kTriangle);
  s.normals({0, 0, 1, 0, 0, 1, 0, 0, 1});
  s.positions({2, 0, 0, 3, 0, 0, 2, 1, 0});
  const auto scene = import_bytes(
      s.glb(one_node("\"attributes\":{\"POSITION\":0,\"NORMAL\":1}},{\"attributes\":{\"POSITION\":2,\"NORMAL\":1}")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->parts.size(), 2U);
  EXPECT_EQ(scene->mesh.position.size(), 6U);
  EXPECT_EQ(scene->mesh.part, (std::vector<std::uint32_t>{0, 1}));
}

TEST(ImportGeometry, PointsAndLinesAreLeftOutWithAWarning) {
  Sample s;
  s.positions(kTriangle);
  const auto scene =
      import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}},{\"attributes\":{\"POSITION\":0},\"mode\":1")));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->mesh.triangles.size(), 1U);
  EXPECT_TRUE(has_warning(*scene, "primitive_without_surface"));
}

TEST(ImportGeometry, UselessTrianglesGoWithACountedWarning) {
  Sample s;
  s.positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 9, 9, 9});
  s.indices({0, 1, 2, /*again*/ 1, 2, 0, /*collinear*/ 0, 1, 3, /*point*/ 1, 1, 2, /*other side*/ 0, 2, 1});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1")));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->mesh.triangles.size(), 2U) << "a face and its other side are both kept";
  EXPECT_EQ(scene->mesh.position.size(), 6U) << "isolated vertices are gone";
  EXPECT_TRUE(has_warning(*scene, "degenerate_triangles_dropped"));
  EXPECT_TRUE(has_warning(*scene, "duplicate_triangles_dropped"));
  for (const Warning& w : scene->warnings) {
    if (w.code == "degenerate_triangles_dropped") {
      EXPECT_EQ(w.message, "2 triangles have no area.");
    }
  }
}

TEST(ImportGeometry, ANeedleOfAspect1e7IsKept) {
  Sample s;
  s.positions({0, 0, 0, 1, 0, 0, 0.5F, 1e-7F, 0});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(length(scene->mesh.normal[0] - Vec3f{0, 0, 1}), 0, 1e-6);
}

TEST(ImportGeometry, NormalsAreMended) {
  Sample s;
  s.positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  s.normals({0, 0, 0, /*zero*/ 0, 0, 7, /*long*/ 0, 0, 1, 0, 0.6F, -0.8F /*behind*/});
  s.indices({0, 1, 2, 1, 3, 2});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0,\"NORMAL\":1},\"indices\":2")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->mesh.normal[0], (Vec3f{0, 0, 1}));
  EXPECT_EQ(scene->mesh.normal[1], (Vec3f{0, 0, 1}));
  EXPECT_NEAR(length(scene->mesh.normal[3] - Vec3f{0, 0.6F, 0.8F}), 0, 1e-6) << "mirrored to the front of its faces";
  for (const char* code : {"normals_computed", "normals_not_unit", "normals_contradict_faces"}) {
    EXPECT_TRUE(has_warning(*scene, code)) << code;
  }
}

TEST(ImportGeometry, WindingThatMostNormalsContradictIsTurned) {
  Sample s;
  s.positions(kTriangle);
  s.normals({0, 0, -1, 0, 0, -1, 0, 0, -1});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0,\"NORMAL\":1}")));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->mesh.normal[0], (Vec3f{0, 0, -1}));
  EXPECT_LT(area_vector(scene->mesh, scene->mesh.triangles[0]).z, 0);
  EXPECT_TRUE(has_warning(*scene, "winding_contradicts_normals"));
}

TEST(ImportGeometry, TangentsTurnWithTheNodeAndChangeHandWhenMirrored) {
  Sample s;
  s.positions(kTriangle);
  s.accessor<float>({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, 5126, "VEC4", 3);
  const auto scene =
      import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0,\"TANGENT\":1}", "\"scale\":[1,-1,1]")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->mesh.tangent[0], (Vec4f{1, 0, 0, -1}));
  EXPECT_TRUE(scene->parts[0].has_tangent);
}

TEST(ImportGeometry, InstancesAreExpanded) {
  Sample s;
  s.positions(kTriangle);
  s.accessor<float>({0, 0, 0, 5, 0, 0, 0, 0, 5}, 5126, "VEC3", 3);
  s.accessor<float>({1, 1, 1, 2, 2, 2, -1, 1, 1}, 5126, "VEC3", 3);
  const std::string node =
      "\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":1,\"SCALE\":2}}}";
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}", node)));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->mesh.triangles.size(), 3U);
  EXPECT_NEAR(length(world(*scene, 4) - Vec3d{7, 0, 0}), 0, 1e-5);
  for (const Triangle& t : scene->mesh.triangles) EXPECT_GT(area_vector(scene->mesh, t).z, 0);
}

TEST(ImportGeometry, InstancesPastTheLimitAreRefusedWithBothNumbersBeforeTheyAreMade) {
  Sample s;
  s.positions(cube_positions());
  s.indices(cube_indices());
  s.accessor(std::vector<float>(3000, 1.0F), 5126, "VEC3", 1000);
  const std::string node = "\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":2}}}";
  const Bytes file = s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1", node));
  const auto by_count = import_bytes(file, {}, {.max_triangles = 11999});
  ASSERT_FALSE(by_count);
  EXPECT_EQ(by_count.error().code, "scene_too_large");
  EXPECT_NE(by_count.error().message.find("12000"), std::string::npos);
  EXPECT_NE(by_count.error().message.find("11999"), std::string::npos);
  const auto by_memory = import_bytes(file, {}, {.max_memory_bytes = 1 << 20});
  ASSERT_FALSE(by_memory);
  EXPECT_EQ(by_memory.error().code, "scene_too_large");
}

TEST(ImportGeometry, LightsStandInUnitLengths) {
  // The triangle is scaled to 10 units, so the frame's scale is 10: intensity falls by 100, directions turn.
  Sample s;
  s.positions(kTriangle);
  const auto scene = import_bytes(
      s.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"extensions\":{\"KHR_lights_punctual\":"
            "{\"lights\":["
            "{\"type\":\"spot\",\"color\":[1,0.5,0],\"intensity\":200,\"range\":20},{\"type\":\"directional\","
            "\"intensity\":3}]}},"
            "\"nodes\":[{\"mesh\":0,\"scale\":[10,10,10]},{\"translation\":[5,5,8],\"extensions\":{\"KHR_lights_"
            "punctual\":{\"light\":0}}},"
            "{\"rotation\":[-0.70710678,0,0,0.70710678],\"extensions\":{\"KHR_lights_punctual\":{\"light\":1}}}]"));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->lights.size(), 2U);
  const Light& spot = scene->lights[0];
  EXPECT_NEAR(length(spot.intensity - Vec3f{2, 1, 0}), 0, 1e-6);
  EXPECT_NEAR(length(spot.position - Vec3f{0, 0, 0.8F}), 0, 1e-6);
  EXPECT_NEAR(spot.range, 2, 1e-6);
  EXPECT_NEAR(length(spot.direction - Vec3f{0, 0, -1}), 0, 1e-6);
  EXPECT_NEAR(length(scene->lights[1].direction - Vec3f{0, -1, 0}), 0, 1e-6);
  EXPECT_FLOAT_EQ(scene->lights[1].intensity.x, 3);
}

}  // namespace
}  // namespace kiln::test
