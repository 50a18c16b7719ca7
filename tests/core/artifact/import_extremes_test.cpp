// Extreme but valid scenes give right results; accuracy.md section 3.
#include <gtest/gtest.h>

#include <cmath>

#include "core/mesh/topology.h"
#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

Result<Scene> import_cube(const std::string& node, float size = 1) {
  Sample s;
  std::vector<float> positions = cube_positions();
  for (float& x : positions) x *= size;
  s.positions(positions);
  s.indices(cube_indices());
  return import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1", node)));
}

TEST(ImportExtremes, TheSizeOfTheSceneChangesNothingButTheFrame) {
  const auto one = import_cube("");
  ASSERT_TRUE(one);
  for (const float size :
       {0x1p-20F, 0x1p-10F, 0x1p10F, 0x1p30F}) {  // 1e-6 to 1e9: powers of two, so bits can be compared
    const auto other = import_cube("", size);
    ASSERT_TRUE(other) << other.error().message;
    EXPECT_EQ(other->mesh.position, one->mesh.position) << size;
    EXPECT_EQ(other->mesh.normal, one->mesh.normal) << size;
    EXPECT_DOUBLE_EQ(other->frame.scale, one->frame.scale * static_cast<double>(size));
  }
  for (const float size : {1e-6F, 1e9F}) {
    const auto other = import_cube("", size);
    ASSERT_TRUE(other);
    for (std::size_t v = 0; v < one->mesh.position.size(); ++v) {
      EXPECT_NEAR(length(other->mesh.position[v] - one->mesh.position[v]), 0, 1e-7);
    }
  }
}

TEST(ImportExtremes, DetailOfOneThousandthSurvivesTenMillionUnitsFromTheOrigin) {
  // Two triangles 1e-3 apart, moved by the node: float world coordinates would have a spacing of 1.
  Sample s;
  s.positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1e-3F, 1, 0, 1e-3F, 0, 1, 1e-3F});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}", "\"translation\":[1e7,1e7,1e7]")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->mesh.triangles.size(), 2U);
  const double gap = (scene->mesh.position[3].z - scene->mesh.position[0].z) * scene->frame.scale;
  // Doubles at 1e7 have a spacing of 2e-9, floats in the cube one of 6e-11 at 5e-4.
  EXPECT_NEAR(gap, 1e-3, 1e-8);
  EXPECT_NEAR(scene->frame.center.x, 1e7 + 0.5, 1e-6);
}

/// A chain of `depth` nodes, each turned and moved a little; the last has the mesh.
std::string chain(int depth) {
  std::string nodes;
  for (int i = 0; i < depth; ++i) {
    nodes += (i > 0 ? "," : "") + std::string("{\"translation\":[0,0,1]");
    nodes += i + 1 < depth ? ",\"children\":[" + std::to_string(i + 1) + "]}" : ",\"mesh\":0}";
  }
  return "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[" + nodes +
         "],\"scenes\":[{\"nodes\":[0]}]";
}

TEST(ImportExtremes, AThousandNestedNodesAddUp) {
  Sample s;
  s.positions(kTriangle);
  const auto scene = import_bytes(s.glb(chain(1000)));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_DOUBLE_EQ(scene->frame.center.z, 1000);
}

TEST(ImportExtremes, DeeperNodesAreRefusedByTheirPlace) {
  Sample s;
  s.positions(kTriangle);
  const auto scene = import_bytes(s.glb(chain(20000)));
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, "node_too_deep");
  EXPECT_EQ(scene.error().where, "scene.glb: /nodes/1024");
}

TEST(ImportExtremes, AFlatAxisIsNoTrouble) {
  const auto scene = import_cube("\"scale\":[1,0,1]");
  ASSERT_TRUE(scene) << scene.error().message;
  for (const Vec3f& p : scene->mesh.position) EXPECT_EQ(p.y, 0);
  for (const Vec3f& n : scene->mesh.normal) EXPECT_NEAR(std::abs(n.y), 1, 1e-6);
}

TEST(ImportExtremes, NegativeAndNonUniformScaleKeepFacesOutside) {
  for (const char* node : {"\"scale\":[-3,2,0.1]", "\"scale\":[-1,-1,-1]", "\"scale\":[1,-1e-3,-1]",
                           "\"matrix\":[0,1,0,0,1,0,0,0,0,0,1,0,0,0,0,1]"}) {
    const auto scene = import_cube(node);
    ASSERT_TRUE(scene) << node;
    for (const Triangle& t : scene->mesh.triangles) {
      const Vec3f area = area_vector(scene->mesh, t);
      EXPECT_GT(dot(area, scene->mesh.position[t[0]]), 0) << node << ": the face looks outwards";
      EXPECT_NEAR(dot(normalized(area), scene->mesh.normal[t[0]]), 1, 1e-5) << node;
    }
  }
}

TEST(ImportExtremes, DenormalsAreNumbers) {
  const auto scene = import_cube("\"scale\":[1e25,1e25,1e25]", 1e-40F);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(scene->frame.scale, 2e-15, 2e-20);  // 1e-40 as a denormal float is right to 1e-45
}

TEST(ImportExtremes, PositionsPast1e18AreRefusedWithTheirElement) {
  Sample s;
  s.positions({0, 0, 0, 1, 0, 0, 0, 2e18F, 0});
  const auto scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0}")));
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, "position_out_of_range");
  EXPECT_NE(scene.error().where.find("/meshes/0/primitives/0/attributes/POSITION element 2"), std::string::npos);
}

TEST(ImportExtremes, NoTriangleIsAnEmptyScene) {
  Sample s;
  s.positions({0, 0, 0, 1, 1, 1, 2, 2, 2});
  for (const std::string& file : {one_node("\"attributes\":{\"POSITION\":0}"), std::string()}) {
    const auto scene = import_bytes(s.glb(file));
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, "empty_scene");
  }
}

}  // namespace
}  // namespace kiln::test
