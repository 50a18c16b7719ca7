#include "core/reduce/collapse.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/reduce/collect.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using testing::Model;

Surface surface_of(const Model& model) {
  Threads threads(2);
  const TriangleSource source = testing::source_of(model);
  return *collect(source, *measure(source, threads), threads);
}

/// How often each directed edge occurs.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges_of(const Surface& s) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> out;
  for (const Triangle& t : s.triangles) {
    for (std::size_t c = 0; c < 3; ++c) ++out[{t[c], t[(c + 1) % 3]}];
  }
  return out;
}

void expect_closed_manifold(const Surface& s) {
  const auto edges = edges_of(s);
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_EQ(s.position.size() + s.triangles.size() - edges.size() / 2, 2U);  // Euler, genus 0
}

TEST(Collect, JoinsCornersAndLeavesOutWhatIsDegenerateOrTwice) {
  Model model = testing::cube(3);
  model.triangles.push_back(model.triangles[5]);
  model.triangles.push_back({model.triangles[7][1], model.triangles[7][2], model.triangles[7][0]});
  model.triangles.push_back({0, 0, 1});
  const Surface s = surface_of(model);
  EXPECT_EQ(s.triangles.size(), 108U);
  expect_closed_manifold(s);
  double area = 0;
  for (const Sample& v : s.sample) area += v.weight;
  EXPECT_NEAR(area, 6, 1e-12);  // a cube of side 2 in the unit cube has sides of 1
}

TEST(Collapse, BringsACubeDownToTwelveTrianglesWithoutError) {
  Surface s = surface_of(testing::cube(8));
  Threads threads(1);
  collapse(s, 12, threads);
  EXPECT_EQ(s.triangles.size(), 12U);
  expect_closed_manifold(s);
  for (const Vec3d& p : s.position) {
    for (std::size_t a = 0; a < 3; ++a)
      EXPECT_NEAR(std::abs(p[a]), 0.5, 1e-4);  // eps of least_point draws off a corner
  }
}

TEST(Collapse, KeepsASphereClosedAndRound) {
  Surface s = surface_of(testing::sphere(24));
  Threads threads(1);
  collapse(s, 400, threads);
  EXPECT_EQ(s.triangles.size(), 400U);
  expect_closed_manifold(s);
  // A triangle of edge a cuts r - sqrt(r^2 - a^2/3) deep into a ball; 400 of them have a^2 = 4 pi r^2 / 400 /
  // (sqrt(3)/4).
  const double depth = 0.5 - std::sqrt(0.25 - 3.1416 / 400 / 0.433 / 3);
  for (const Vec3d& p : s.position) EXPECT_NEAR(length(p), 0.5, depth);
}

TEST(Collapse, KeepsTheOutlineOfAPlaneAndItsArea) {
  Surface s = surface_of(testing::sheet(20, 10, [](double u, double v) { return Vec3d{2 * u, v, 0}; }));
  Threads threads(1);
  collapse(s, 2, threads);
  EXPECT_EQ(s.triangles.size(), 2U);
  double area = 0;
  for (const auto& [a, b, c] : s.triangles)
    area += 0.5 * cross(s.position[b] - s.position[a], s.position[c] - s.position[a]).z;
  EXPECT_NEAR(area, 0.5, 1e-3);  // 1 x 1/2 in the unit cube
}

TEST(Collapse, LetsSpecksVanishBeforeItGivesUp) {
  Model model = testing::sphere(10);
  for (int i = 0; i < 50; ++i) {
    Model speck = testing::cube(1);
    for (Vec3d& p : speck.position) p = p * 0.001 + Vec3d{1.2, 0.04 * i - 1, 0};
    append(model, speck);
  }
  Surface s = surface_of(model);
  Threads threads(1);
  collapse(s, 100, threads);  // fifty specks of four triangles each would be too many
  EXPECT_LE(s.triangles.size(), 100U);
  EXPECT_GT(s.triangles.size(), 50U);
}

TEST(Collapse, DownToFourTrianglesLeavesATetrahedron) {
  Surface s = surface_of(testing::sphere(6));
  Threads threads(1);
  collapse(s, 4, threads);
  EXPECT_EQ(s.triangles.size(), 4U);
  expect_closed_manifold(s);
}

TEST(Collapse, CarriesColoursAlongByArea) {
  Model model = testing::sheet(16, 16, [](double u, double v) { return Vec3d{u, v, 0}; });
  for (const Vec3d& p : model.position) model.color.push_back(p.x < 0.5 ? Vec3f{1, 0, 0} : Vec3f{0, 0, 1});
  Surface s = surface_of(model);
  Vec3f before, after;
  for (const Sample& v : s.sample) before += v.color;
  Threads threads(1);
  collapse(s, 40, threads);
  for (const Sample& v : s.sample) after += v.color;
  EXPECT_LT(length(after - before), 1e-5F);  // a sum of some hundred floats
}

}  // namespace
}  // namespace kiln
