#include "core/mesh/quadric.h"

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace kiln {
namespace {

Vec3d random_point(Random& random) {
  return {random.uniform_double() - 0.5, random.uniform_double() - 0.5, random.uniform_double() - 0.5};
}

TEST(Quadric, OfAPlaneIsTheWeightedSquareOfTheDistance) {
  for (std::uint64_t i = 0; i < 100; ++i) {
    Random random(1, i);
    const Vec3d n = normalized(random_point(random)), on = random_point(random), p = random_point(random);
    Quadric q;
    q.add_plane(n, dot(n, on), 3);
    const double distance = dot(n, p - on);
    EXPECT_NEAR(q.at(p), 3 * distance * distance, 1e-14);  // ten roundings of numbers below 10
    EXPECT_NEAR(q.trace(), 3, 1e-14);
  }
}

TEST(Quadric, OfALineIsTheSquaredDistanceTimesTheSquaredLength) {
  for (std::uint64_t i = 0; i < 100; ++i) {
    Random random(2, i);
    const Vec3d a = random_point(random), b = random_point(random), p = random_point(random);
    Quadric q;
    q.add_line(b - a, cross(a, b), 2);
    const Vec3d apart = cross(b - a, p - a);
    EXPECT_NEAR(q.at(p), 2 * dot(apart, apart), 1e-14);
    EXPECT_NEAR(q.at(a + (b - a) * 0.3), 0, 1e-15);
  }
}

TEST(Quadric, IsLeastWhereThreePlanesMeet) {
  const Vec3d corner{0.3, -0.2, 0.4};
  Quadric q;
  for (const Vec3d n : {Vec3d{1, 0, 0}, normalized(Vec3d{0.2, 1, 0}), normalized(Vec3d{0.1, 0.2, 1})})
    q.add_plane(n, dot(n, corner), 1);
  EXPECT_LT(length(least_point(q, {0, 0, 0}, 1e-12) - corner), 1e-10);
  EXPECT_LT(length(least_point(q, {0.31, -0.2, 0.4}) - corner), 0.01 * 0.02);  // eps over the least eigenvalue, 0.8 / 3
}

TEST(Quadric, LeavesTheAnchorWhereItDoesNotCare) {
  Quadric q;
  q.add_plane({0, 0, 1}, 0.25, 2);
  const Vec3d p = least_point(q, {0.1, 0.2, 0.3});
  EXPECT_NEAR(p.x, 0.1, 1e-15);
  EXPECT_NEAR(p.y, 0.2, 1e-15);
  EXPECT_NEAR(p.z, 0.25, 0.05 * 2e-3);  // eps of the way back to the anchor
  EXPECT_EQ(least_point(Quadric{}, {1, 2, 3}), (Vec3d{1, 2, 3}));
}

}  // namespace
}  // namespace kiln
