#include "core/mesh/part_vertices.h"

#include <gtest/gtest.h>

namespace kiln {
namespace {

/// Four triangles around vertex 0: (1,2), (2,3), (3,4), (4,1).
Mesh fan() {
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  mesh.normal.assign(5, {0, 0, 1});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
  mesh.part.assign(4, 0);
  return mesh;
}

TEST(PartVertices, AnEdgeThatEndsInsidePartsItsOtherEndOnly) {
  Mesh mesh = fan();
  part_vertices(mesh, {{0, 1}});
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}));
  EXPECT_EQ(mesh.position[5], mesh.position[1]);
}

TEST(PartVertices, ALineThroughAVertexPartsIt) {
  Mesh mesh = fan();
  part_vertices(mesh, {{0, 1}, {0, 3}});
  ASSERT_EQ(mesh.position.size(), 8U);  // copies of 0, and of 1 and 3, which lie on the border
  EXPECT_EQ(mesh.triangles[0][0], mesh.triangles[1][0]);
  EXPECT_EQ(mesh.triangles[2][0], mesh.triangles[3][0]);
  EXPECT_NE(mesh.triangles[0][0], mesh.triangles[2][0]);
  for (const Triangle& t : mesh.triangles) EXPECT_EQ(mesh.position[t[0]], Vec3f{});
}

TEST(PartVertices, EveryShareBetweenEdgesHasItsOwn) {
  Mesh mesh = fan();
  part_vertices(mesh, {{0, 1}, {0, 2}, {0, 3}, {0, 4}});
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = 0; b < a; ++b) EXPECT_NE(mesh.triangles[a][0], mesh.triangles[b][0]);
  }
}

}  // namespace
}  // namespace kiln
