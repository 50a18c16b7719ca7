#include "core/prt/subdivide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/mesh/midpoint.h"
#include "core/mesh/topology.h"
#include "tests/core/prt/crack_check.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

using testing::find_crack;

// A field with a soft edge on a sphere about a point: something to refine for.
std::vector<float> ball_field(std::span<const TransferPoint> points) {
  std::vector<float> values;
  for (const TransferPoint& p : points) {
    const float d = length(p.position - Vec3f{0.11F, -0.17F, 0.07F});
    values.push_back(std::tanh(40 * (d - 0.2F)));
    values.push_back(p.normal.x * d);
  }
  return values;
}

const ValueSource kBall{2, ball_field};

constexpr std::array kMeasures = {SplitMeasure::residual, SplitMeasure::eq2, SplitMeasure::eq3, SplitMeasure::eq4};

Subdivided refine(const Mesh& mesh, SplitMeasure measure, std::uint64_t budget) {
  Threads threads(1);
  return subdivide(mesh, kBall, {.measure = measure, .triangles = budget}, threads);
}

TEST(Subdivide, LeavesNoCrackOnRandomMeshesWithSeamsAndNonManifoldEdges) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Mesh mesh = testing::random_scene(seed, 40).mesh;
    for (const SplitMeasure measure : kMeasures) {
      const Subdivided result = refine(mesh, measure, 200 + 37 * seed);
      EXPECT_EQ(find_crack(mesh, result.mesh), "") << "seed " << seed;
    }
  }
}

TEST(Subdivide, LeavesNoCrackOnTheColumn) {
  const Mesh mesh = testing::column_scene().mesh;
  for (const SplitMeasure measure : kMeasures) {
    const Subdivided result = refine(mesh, measure, 3000);
    EXPECT_GT(result.mesh.triangles.size(), 2900U);
    EXPECT_EQ(find_crack(mesh, result.mesh), "");
  }
}

TEST(Subdivide, TheCrackCheckSeesAHangingVertex) {
  Mesh whole = testing::empty_scene().mesh;
  whole.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  whole.normal.assign(4, {0, 0, 1});
  whole.triangles = {{0, 1, 2}, {2, 1, 3}};
  whole.part = {0, 0};
  Mesh hanging = whole;
  hanging.position.push_back({0.5F, 0.5F, 0});
  hanging.normal.push_back({0, 0, 1});
  hanging.triangles = {{0, 1, 4}, {0, 4, 2}, {2, 1, 3}};
  hanging.part = {0, 0, 0};
  EXPECT_NE(find_crack(whole, hanging), "");
  hanging.triangles = {{0, 1, 4}, {0, 4, 2}, {2, 4, 3}, {4, 1, 3}};
  EXPECT_EQ(find_crack(whole, hanging), "");
}

TEST(Subdivide, NeverExceedsTheBudgetOfFinalTriangles) {
  for (std::uint64_t seed = 100; seed < 130; ++seed) {
    const Mesh mesh = testing::random_scene(seed, 30).mesh;
    for (const std::uint64_t budget : {0U, 29U, 30U, 31U, 33U, 34U, 50U, 111U, 400U}) {
      const Subdivided result = refine(mesh, SplitMeasure::eq3, budget);
      EXPECT_LE(result.mesh.triangles.size(), std::max<std::size_t>(budget, mesh.triangles.size()));
    }
  }
}

TEST(Subdivide, KeepsEveryPartsArea) {
  const Mesh mesh = testing::random_scene(7, 60).mesh;
  const Mesh fine = refine(mesh, SplitMeasure::residual, 2000).mesh;
  const auto areas = [](const Mesh& m) {
    std::array<double, 2> sum{};
    for (std::size_t t = 0; t < m.triangles.size(); ++t) sum[m.part[t]] += triangle_area(m, m.triangles[t]);
    return sum;
  };
  // The lattice makes every midpoint exact in float; what is left is the rounding of the sum in double.
  for (std::size_t part = 0; part < 2; ++part) EXPECT_NEAR(areas(fine)[part], areas(mesh)[part], 1e-12);
}

TEST(Subdivide, AVertexStaysInOnePart) {
  const Mesh mesh = testing::random_scene(8, 60).mesh;
  const Mesh fine = refine(mesh, SplitMeasure::eq4, 1500).mesh;
  std::vector<std::set<std::uint32_t>> parts(fine.position.size());
  for (std::size_t t = 0; t < fine.triangles.size(); ++t) {
    for (const std::uint32_t v : fine.triangles[t]) parts[v].insert(fine.part[t]);
  }
  for (const auto& of_vertex : parts) EXPECT_LE(of_vertex.size(), 1U);
}

TEST(Subdivide, ValuesAreThoseOfTheSourceAndEachPointIsAskedOnce) {
  const Mesh mesh = testing::column_scene().mesh;
  std::set<std::array<float, 6>> asked;
  std::uint64_t calls = 0;
  const ValueSource source{
      2, [&](std::span<const TransferPoint> points) {
        for (const TransferPoint& p : points) {
          asked.insert({p.position.x, p.position.y, p.position.z, p.normal.x, p.normal.y, p.normal.z});
        }
        calls += points.size();
        return ball_field(points);
      }};
  Threads threads(1);
  const Subdivided result = subdivide(mesh, source, {.measure = SplitMeasure::eq3, .triangles = 2000}, threads);
  EXPECT_EQ(result.evaluated, calls);
  // A vertex stands where its position and normal say; the column's seams repeat positions, not pairs.
  EXPECT_EQ(asked.size(), calls);
  ASSERT_EQ(result.values.size(), 2 * result.mesh.position.size());
  std::vector<TransferPoint> points;
  for (std::size_t v = 0; v < result.mesh.position.size(); ++v) {
    points.push_back({.position = result.mesh.position[v], .normal = result.mesh.normal[v]});
  }
  const std::vector<float> asked_again = ball_field(points);
  for (std::size_t i = 0; i < asked_again.size(); ++i) {
    EXPECT_NEAR(asked_again[i], result.values[i], 0x1p-13);  // rows are kept in 16 bits; the field is below 1
  }
}

TEST(Subdivide, InputVerticesKeepTheirPlaces) {
  const Mesh mesh = testing::random_scene(3, 50).mesh;
  const Mesh fine = refine(mesh, SplitMeasure::eq3, 500).mesh;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) EXPECT_EQ(fine.position[v], mesh.position[v]);
}

TEST(Subdivide, AThresholdStopsBeforeTheBudget) {
  const Mesh mesh = testing::column_scene().mesh;
  Threads threads(1);
  Subdivide params{.measure = SplitMeasure::residual, .threshold = 1e9F, .triangles = 5000};
  EXPECT_EQ(subdivide(mesh, kBall, params, threads).mesh.triangles.size(), mesh.triangles.size());
  params.threshold = 1e-3F;
  const std::size_t some = subdivide(mesh, kBall, params, threads).mesh.triangles.size();
  EXPECT_GT(some, mesh.triangles.size());
  EXPECT_LT(some, 5000U);
}

TEST(Subdivide, NoTriangleIsSplitDeeperThanAllowed) {
  const Mesh mesh = testing::column_scene().mesh;
  Threads threads(1);
  const Subdivided result = subdivide(mesh, kBall, {.triangles = 100000, .max_depth = 2}, threads);
  // Every split of a 246-triangle mesh to depth 2, at most.
  EXPECT_LE(result.mesh.triangles.size(), mesh.triangles.size() * 16);
  EXPECT_LE(*std::max_element(result.depth.begin(), result.depth.end()), 2);
}

TEST(Subdivide, AConstantFieldIsNeverSplit) {
  const Mesh mesh = testing::column_scene().mesh;
  Threads threads(1);
  const ValueSource constant{1, [](std::span<const TransferPoint> p) { return std::vector<float>(p.size(), 0.7F); }};
  for (const SplitMeasure measure : kMeasures) {
    const Subdivided result = subdivide(mesh, constant, {.measure = measure, .triangles = 9999}, threads);
    EXPECT_EQ(result.mesh.triangles, mesh.triangles);
  }
}

TEST(Subdivide, AllAttributesAreInterpolated) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 2, 2);
  Mesh& mesh = scene.mesh;
  for (const Vec3f& p : mesh.position) {
    mesh.uv0.push_back({p.x, p.z});
    mesh.uv1.push_back({p.z, 2 * p.x});
    mesh.color.push_back({p.x, p.z, 0.25F, 1});
    mesh.tangent.push_back({1, 0, 0, -1});
  }
  const Mesh fine = refine(mesh, SplitMeasure::residual, 300).mesh;
  ASSERT_EQ(fine.uv0.size(), fine.position.size());
  ASSERT_EQ(fine.tangent.size(), fine.position.size());
  for (std::size_t v = 0; v < fine.position.size(); ++v) {  // linear in the position, exactly: powers of two
    EXPECT_EQ(fine.uv0[v], (Vec2f{fine.position[v].x, fine.position[v].z}));
    EXPECT_EQ(fine.uv1[v], (Vec2f{fine.position[v].z, 2 * fine.position[v].x}));
    EXPECT_EQ(fine.color[v], (Vec4f{fine.position[v].x, fine.position[v].z, 0.25F, 1}));
    EXPECT_EQ(fine.tangent[v], (Vec4f{1, 0, 0, -1}));
  }
}

TEST(Subdivide, TheSameMeshForAnyThreadCount) {
  const Mesh mesh = testing::knot_scene().mesh;
  Threads one(1), two(2);
  const Subdivide params{.triangles = 5000};
  const Subdivided a = subdivide(mesh, kBall, params, one), b = subdivide(mesh, kBall, params, two);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.values, b.values);
}

}  // namespace
}  // namespace kiln
