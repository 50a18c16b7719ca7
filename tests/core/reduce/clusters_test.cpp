#include "core/reduce/clusters.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using testing::Model;

Surface clustered(const Model& model, const Clustering& params, int count = 2) {
  Threads threads(count);
  const TriangleSource source = testing::source_of(model);
  return *cluster(source, *measure(source, threads), params, threads);
}

Vec3d area_vector(const Surface& s, const Triangle& t) {
  return cross(s.position[t[1]] - s.position[t[0]], s.position[t[2]] - s.position[t[0]]) * 0.5;
}

TEST(Measure, KnowsTheBoxAndTheAreaOfACube) {
  Threads threads(2);
  const TriangleSource source = testing::source_of(testing::cube(5));
  const auto extent = measure(source, threads);
  ASSERT_TRUE(extent);
  EXPECT_EQ(extent->low, (Vec3d{-1, -1, -1}));
  EXPECT_EQ(extent->high, (Vec3d{1, 1, 1}));
  EXPECT_NEAR(extent->area, 24, 1e-12);
  EXPECT_EQ(extent->triangles, 300U);
}

TEST(Clusters, OfAPlaneLieInItAndKeepItsOutline) {
  for (const std::uint64_t leaves : {0, 60}) {
    const Surface s = clustered(testing::sheet(100, 100,
                                               [](double u, double v) {
                                                 return Vec3d{u, v, 0.3 * u};
                                               }),
                                {.cells = 400, .vertices = leaves});
    ASSERT_GT(s.triangles.size(), 20U);
    double area = 0;
    for (const Vec3d& p : s.position) EXPECT_NEAR(p.z, 0.3 * p.x, 1e-9);
    for (const Triangle& t : s.triangles) area += area_vector(s, t).z;
    EXPECT_NEAR(area, 1,
                0.02);  // corners are cut by less than a cell's area each, and half of a cell where rims are uneven
  }
}

TEST(Clusters, OfASphereLieOnItAndLookOutwards) {
  const Surface s = clustered(testing::sphere(60), {.cells = 3000});
  const double cell = std::sqrt(1.7 * 3.1416 / (0.7 * 3000));
  for (const Vec3d& p : s.position) EXPECT_NEAR(length(p), 0.5, 0.5 * cell * cell);  // sagitta of a patch of two cells
  Vec3d sum;
  double volume = 0;
  for (const Triangle& t : s.triangles) {
    sum += area_vector(s, t);
    volume += dot(s.position[t[0]], area_vector(s, t)) / 3;
  }
  EXPECT_LT(length(sum), 1e-3 * 3.1416);  // closed, but for pairs of triangles that became one
  EXPECT_NEAR(volume, 3.14159 / 6, 0.01 * 3.14159 / 6);
}

TEST(Clusters, AreAsManyAsAllowedWhateverWasGuessed) {
  // Relief that has many times the area of what it covers: the first guess of the cell's size is far off.
  const Model rough = testing::sheet(200, 200, [](double u, double v) {
    return Vec3d{u, v, 0.02 * std::sin(200 * u) * std::cos(210 * v)};
  });
  for (const std::uint64_t cells : {200, 1000, 5000}) {
    const Surface s = clustered(rough, {.cells = cells});
    EXPECT_LE(s.position.size(), cells);
    EXPECT_GT(s.position.size(), cells / 16);  // two coarsenings at most
  }
}

TEST(Clusters, AreFineWhereTheSurfaceIsCurved) {
  // Flat but for a ripple in one corner, a sixteenth of the area.
  const Model model = testing::sheet(160, 160, [](double u, double v) {
    return Vec3d{u, v, u < 0.25 && v < 0.25 ? 0.01 * std::sin(150 * u) * std::sin(150 * v) : 0};
  });
  const Surface s = clustered(model, {.cells = 6000, .vertices = 500});
  EXPECT_LE(s.position.size(), 500U);
  std::size_t rippled = 0;
  for (const Vec3d& p : s.position) rippled += p.x < -0.25 && p.y < -0.25 ? 1 : 0;
  EXPECT_GT(rippled, s.position.size() / 4);  // of a sixteenth of the area
}

TEST(Clusters, AreTheSameForAnyNumberOfThreads) {
  const Model model = testing::sphere(150);  // several batches
  for (const std::uint64_t leaves : {0, 700}) {
    const Surface one = clustered(model, {.cells = 3000, .vertices = leaves}, 1);
    const Surface four = clustered(model, {.cells = 3000, .vertices = leaves}, 4);
    EXPECT_EQ(one.position, four.position);
    EXPECT_EQ(one.triangles, four.triangles);
  }
}

TEST(Clusters, HaveNoDegenerateAndNoRepeatedTriangle) {
  const Surface s = clustered(testing::sphere(80), {.cells = 500});
  std::map<Triangle, int> seen;
  for (const Triangle& t : s.triangles) {
    EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    EXPECT_EQ(++seen[t], 1);
  }
}

TEST(Clusters, FarFromTheOriginAreAsGood) {
  Model model = testing::sphere(40);
  const Surface near = clustered(model, {.cells = 1000});
  for (Vec3d& p : model.position) p += Vec3d{1e7, -1e7, 1e7};
  const Surface far = clustered(model, {.cells = 1000});
  ASSERT_NEAR(static_cast<double>(far.position.size()), static_cast<double>(near.position.size()),
              0.02 * static_cast<double>(near.position.size()));  // doubles hold 2e-9 there: some points change cells
  for (const Vec3d& p : far.position) EXPECT_NEAR(length(p), 0.5, 0.01);
}

}  // namespace
}  // namespace kiln
