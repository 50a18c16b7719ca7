#include "core/mesh/closest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace kiln {
namespace {

void add_triangle(Mesh& mesh, const std::array<Vec3f, 3>& corners) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  const Vec3f normal = normalized(cross(corners[1] - corners[0], corners[2] - corners[0]));
  for (const Vec3f& corner : corners) {
    mesh.position.push_back(corner);
    mesh.normal.push_back(normal);
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.part.push_back(0);
}

void add_square(Mesh& mesh, const Vec3f& corner, const Vec3f& a, const Vec3f& b) {
  add_triangle(mesh, {corner, corner + a, corner + a + b});
  add_triangle(mesh, {corner, corner + a + b, corner + b});
}

Vec3f random_point(Random& random) {
  return {random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F};
}

Mesh random_triangles(std::uint64_t seed, int count) {
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const Vec3f center = random_point(random);
    add_triangle(mesh, {center, center + random_point(random) * 0.2F, center + random_point(random) * 0.2F});
  }
  return mesh;
}

/// Distance to a triangle by sampling its barycentrics on a grid: an upper bound that is at most `step` too far.
double sampled_distance(const Mesh& mesh, const Vec3d& point, int grid) {
  double best = HUGE_VAL;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i <= grid; ++i) {
      for (int j = 0; j + i <= grid; ++j) {
        best = std::min(best, length(match_position(mesh, {t, double(i) / grid, double(j) / grid, 0}) - point));
      }
    }
  }
  return best;
}

TEST(ClosestPoint, IsNeverFartherThanAnySampledPointOfTheSurface) {
  const Mesh mesh = random_triangles(1, 40);
  const ClosestPoint closest(mesh);
  const int grid = 40;
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(2, i);
    const Vec3d point = to_double(random_point(random)) * 1.5;
    const auto match = closest.query(point, {0, 0, 0});
    ASSERT_TRUE(match);
    const double sampled = sampled_distance(mesh, point, grid);
    EXPECT_LE(match->distance, sampled + ClosestPoint::kSamePlace);
    // The grid's cells have sides of at most |edge| / grid, and edges are shorter than 2 * 0.2 * sqrt(3)/2.
    EXPECT_GE(match->distance, sampled - 0.35 / grid);
    EXPECT_NEAR(length(match_position(mesh, *match) - point), match->distance, 1e-12);  // double rounding
  }
}

TEST(ClosestPoint, ChoosesTheSheetWhoseNormalAgrees) {
  Mesh mesh;
  add_square(mesh, {-0.5F, 0.0F, 0.5F}, {1, 0, 0}, {0, 0, -1});     // faces up
  add_square(mesh, {-0.5F, -0.001F, -0.5F}, {1, 0, 0}, {0, 0, 1});  // a thousandth below, faces down
  const ClosestPoint closest(mesh);
  const Vec3d between{0.1, -0.0009, 0.2};
  const auto up = closest.query(between, {0, 1, 0}), down = closest.query(between, {0, -1, 0});
  ASSERT_TRUE(up && down);
  EXPECT_LT(up->triangle, 2U);
  EXPECT_GE(down->triangle, 2U);
  EXPECT_NEAR(up->distance, 0.0009, 1e-9);  // -0.001 is a float
}

TEST(ClosestPoint, OnAnEdgeTheFaceOfTheQueryNormalWins) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, {0, 0, 1}, {1, 0, 0});  // floor, up
  add_square(mesh, {0, 0, 0}, {0, 1, 0}, {0, 0, 1});  // wall, along +x
  const ClosestPoint closest(mesh);
  for (const double off : {0.0, 1e-9, -1e-9}) {
    const Vec3d corner{off, off, 0.3};
    EXPECT_LT(closest.query(corner, {0.3, 1, 0})->triangle, 2U);
    EXPECT_GE(closest.query(corner, {1, 0.3, 0})->triangle, 2U);
  }
}

TEST(ClosestPoint, APerpendicularWallIsNotCompatibleEvenWithAQuantisedNormal) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, {0, 0, 1}, {1, 0, 0});
  add_square(mesh, {0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const ClosestPoint closest(mesh);
  // 1e-6 from the wall, 1.5e-5 (a 16-bit position step) above the floor; the normal is off by a 10-bit step.
  const auto match = closest.query({1e-6, 1.5e-5, 0.4}, {1.0 / 1024, 1, 0});
  ASSERT_TRUE(match);
  EXPECT_LT(match->triangle, 2U);
}

TEST(ClosestPoint, FindsNothingWhereNoNormalIsCompatibleOrNothingIsInReach) {
  Mesh mesh;
  add_square(mesh, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1});
  const ClosestPoint closest(mesh);
  EXPECT_FALSE(closest.query({0, 0.1, 0}, {0, -1, 0}));
  EXPECT_FALSE(closest.query({0, 0.1, 0}, {0, 1, 0}, 0.05));
  EXPECT_TRUE(closest.query({0, 0.1, 0}, {0, 1, 0}, 0.11));
  const Mesh empty;
  EXPECT_FALSE(ClosestPoint(empty).query({0, 0, 0}, {0, 0, 0}));
}

TEST(ClosestPoint, DegenerateTrianglesAreTheSegmentsAndPointsThatTheyAre) {
  Mesh mesh;
  add_triangle(mesh, {Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0.5F, 0, 0}});
  add_triangle(mesh, {Vec3f{3, 0, 0}, Vec3f{3, 0, 0}, Vec3f{3, 0, 0}});
  const ClosestPoint closest(mesh);
  EXPECT_DOUBLE_EQ(closest.query({0.25, 2, 0}, {0, 0, 0})->distance, 2);
  EXPECT_DOUBLE_EQ(closest.query({3, 0, 4}, {0, 0, 0})->distance, 4);
  EXPECT_EQ(closest.query({3, 0, 4}, {0, 0, 0})->triangle, 1U);
}

TEST(ClosestPoint, HandlesMoreTrianglesAtOnePlaceThanALeafHolds) {
  Mesh mesh;
  for (int i = 0; i < 100; ++i) add_square(mesh, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1});
  const auto match = ClosestPoint(mesh).query({0.1, 0.3, -0.2}, {0, 1, 0});
  ASSERT_TRUE(match);
  EXPECT_LT(match->triangle, 2U) << "of equal places the lowest index";
  EXPECT_NEAR(match->distance, 0.3, 1e-12);
}

}  // namespace
}  // namespace kiln
