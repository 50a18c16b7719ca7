#include "core/base/vec.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/random.h"

namespace kiln {
namespace {

void expect_orthonormal(const Vec3d& n) {
  const Basis<double> b = basis_around(n);
  EXPECT_EQ(b.z, n);
  EXPECT_NEAR(length(b.x), 1, 1e-14);
  EXPECT_NEAR(length(b.y), 1, 1e-14);
  EXPECT_NEAR(dot(b.x, b.y), 0, 1e-14);
  EXPECT_NEAR(dot(b.x, n), 0, 1e-14);
  EXPECT_NEAR(dot(b.y, n), 0, 1e-14);
  EXPECT_NEAR(length(cross(b.x, b.y) - n), 0, 1e-14) << "right-handed";
}

TEST(Basis, IsOrthonormalAndRightHandedEverywhereAlsoAtThePoles) {
  expect_orthonormal({0, 0, 1});
  expect_orthonormal({0, 0, -1});
  expect_orthonormal({0, 1, -0.0});
  expect_orthonormal(normalized(Vec3d{1e-9, 0, -1}));
  Random random(1, 0);
  for (int i = 0; i < 1000; ++i)
    expect_orthonormal(
        normalized(Vec3d{random.uniform_double() - 0.5, random.uniform_double() - 0.5, random.uniform_double() - 0.5}));
}

TEST(Basis, ToWorldAndBackIsTheIdentity) {
  const Basis<double> b = basis_around(normalized(Vec3d{1, 2, -3}));
  const Vec3d v{0.3, -0.4, 0.5};
  EXPECT_NEAR(length(b.to_local(b.to_world(v)) - v), 0, 1e-15);
  EXPECT_EQ(b.to_world({0, 0, 1}), b.z);
}

TEST(Vec, NormalizedNeverDividesByNothing) {
  EXPECT_EQ(normalized(Vec3f{}), (Vec3f{0, 1, 0}));
  EXPECT_EQ(normalized(Vec3f{}, {1, 0, 0}), (Vec3f{1, 0, 0}));
  EXPECT_EQ(normalized(Vec3f{std::nanf(""), 0, 0}), (Vec3f{0, 1, 0}));
  EXPECT_EQ(normalized(Vec3f{std::numeric_limits<float>::infinity(), 0, 0}), (Vec3f{0, 1, 0}));
  EXPECT_EQ(normalized(Vec3f{0, 0, -5}), (Vec3f{0, 0, -1}));
}

TEST(Vec, CrossProductIsRightHanded) {
  EXPECT_EQ(cross(Vec3f{1, 0, 0}, Vec3f{0, 1, 0}), (Vec3f{0, 0, 1}));
  EXPECT_EQ(dot(Vec3f{1, 2, 3}, Vec3f{4, 5, 6}), 32);
}

TEST(Vec, FinitenessLooksAtAllThreeNumbers) {
  EXPECT_TRUE(is_finite(Vec3f{1, 2, 3}));
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3f v{1, 2, 3};
    v[i] = std::nanf("");
    EXPECT_FALSE(is_finite(v));
  }
}

}  // namespace
}  // namespace kiln
