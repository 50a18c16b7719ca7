#include "core/mesh/topology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kiln {
namespace {

TEST(Weld, PointsAtTheSamePlaceShareTheLowestIndex) {
  const std::vector<Vec3f> points{{1, 2, 3}, {0, 0, 0}, {1, 2, 3}, {0, -0.0F, 0}, {1, 2, 3.0000002F}, {1, 2, 3}};
  EXPECT_EQ(weld_by_position(points), (std::vector<std::uint32_t>{0, 1, 0, 1, 4, 0}));
}

TEST(Weld, TinyDifferencesAreDifferentPlaces) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  EXPECT_EQ(weld_by_position({{0, 0, 0}, {tiny, 0, 0}, {-tiny, 0, 0}}), (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_TRUE(weld_by_position({}).empty());
}

TEST(Area, OfATriangleIsHalfItsAreaVector) {
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {0, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 1}, {0, 1, 3}};
  EXPECT_EQ(area_vector(mesh, mesh.triangles[0]), (Vec3f{0, 0, 12}));
  EXPECT_EQ(area_vector(mesh, mesh.triangles[1]), (Vec3f{0, 0, -12}));
  EXPECT_EQ(triangle_area(mesh, mesh.triangles[0]), 6);
  EXPECT_EQ(triangle_area(mesh, mesh.triangles[2]), 0);
  EXPECT_EQ(surface_area(mesh), 12);
}

TEST(Area, OfSmallTrianglesDoesNotUnderflow) {
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1e-30F, 0, 0}, {0, 1e-30F, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_NEAR(surface_area(mesh) / 5e-61, 1, 1e-6);  // 1e-30 as a float
}

}  // namespace
}  // namespace kiln
