#include "core/reduce/near_surface.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/mesh/triangle_distance.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using testing::sphere;

Mesh mesh_of(const testing::Model& model) {
  Mesh mesh;
  for (const Vec3d& p : model.position) {
    mesh.position.push_back(to_float(p * 0.5));
    mesh.normal.push_back(to_float(normalized(p)));
  }
  mesh.triangles = model.triangles;
  return mesh;
}

TEST(NearestPlace, IsNoFartherThanAnyPlaceOfTheTriangle) {
  for (std::uint64_t i = 0; i < 300; ++i) {
    Random random(3, i);
    const auto point = [&] { return Vec3d{random.uniform_double(), random.uniform_double(), random.uniform_double()}; };
    const FlatTriangle f(point(), point(), point());
    const Vec3d p = point() * 2.0;
    const NearPlace near = nearest_place(f, p);
    const Vec3d offset = p - (f.a + f.e1 * near.u + f.e2 * near.v);
    EXPECT_NEAR(near.squared, dot(offset, offset), 1e-12);
    EXPECT_TRUE(near.u >= 0 && near.v >= 0 && near.u + near.v <= 1 + 1e-12);
    for (int k = 0; k < 200; ++k) {
      const double r = std::sqrt(random.uniform_double()), v = r * random.uniform_double();
      const Vec3d other = p - (f.a + f.e1 * (r - v) + f.e2 * v);
      EXPECT_GE(dot(other, other), near.squared - 1e-12);
    }
    EXPECT_FALSE(f.is_beyond(p, std::sqrt(near.squared) + 1e-9));
  }
}

TEST(NearestPlace, OfATriangleWithoutAreaIsOnItsEdges) {
  const FlatTriangle line({0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}), dot3({1, 1, 1}, {1, 1, 1}, {1, 1, 1});
  EXPECT_NEAR(nearest_place(line, {0.25, 0.5, 0}).squared, 0.25, 1e-15);
  EXPECT_NEAR(nearest_place(line, {2, 0, 0}).squared, 1, 1e-15);
  EXPECT_NEAR(nearest_place(dot3, {1, 1, 3}).squared, 4, 1e-15);
}

TEST(NearSurface, AgreesWithTheTree) {
  const Mesh mesh = mesh_of(sphere(12));
  const NearSurface fast(mesh);
  const ClosestPoint slow(mesh);
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(4, i);
    const Vec3d out =
        normalized(Vec3d{random.uniform_double() - 0.5, random.uniform_double() - 0.5, random.uniform_double() - 0.5});
    const Vec3d p = out * (0.3 + 0.4 * random.uniform_double());  // near the surface and far from it
    const auto a = fast.query(p, out);
    const auto b = slow.query(p, out);
    ASSERT_TRUE(a && b);
    EXPECT_NEAR(a->distance, b->distance, 2 * ClosestPoint::kSamePlace);
  }
}

TEST(NearSurface, PrefersTheSideThatLooksTheSameWay) {
  testing::Model two = testing::sheet(4, 4, [](double u, double v) { return Vec3d{u, v, 0.01}; });
  append(two, testing::sheet(4, 4, [](double u, double v) { return Vec3d{v, u, -0.01}; }));  // looks down
  const Mesh mesh = mesh_of(two);
  const NearSurface near(mesh);
  const auto up = near.query({0.2, 0.2, 0.001}, {0, 0, 1}), down = near.query({0.2, 0.2, 0.001}, {0, 0, -1});
  ASSERT_TRUE(up && down);
  EXPECT_LT(up->place.triangle, 32U);
  EXPECT_GE(down->place.triangle, 32U);
  EXPECT_NEAR(down->place.distance, 0.006, 1e-8);
  EXPECT_NEAR(down->distance, 0.004, 1e-8);  // of any side
}

}  // namespace
}  // namespace kiln
