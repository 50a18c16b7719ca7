#include "core/reduce/reduce.h"

#include <gtest/gtest.h>

#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using testing::Model;

Result<Reduced> reduced(const Model& model, const Reduce& params, int count = 2) {
  Threads threads(count);
  const TriangleSource source = testing::source_of(model);
  KILN_TRY(plan, plan_reduction(source, params));
  return reduce(source, plan, params, threads);
}

/// A plan that clusters although the model is small: what a real one makes of a model a thousand times as large.
ReducePlan clustering(std::uint64_t vertices, int map_side) {
  return {.cells = 4 * vertices, .vertices = vertices, .map_side = map_side};
}

TEST(Reduce, KnowsHowFarASphereIsFromItsReduction) {
  const auto out = reduced(testing::sphere(60), {.triangles = 600, .map_side = 0});
  ASSERT_TRUE(out);
  EXPECT_LE(out->mesh.triangles.size(), 600U);
  // Mean height of a sphere of radius r over a triangle of edge a whose corners are moved out to halve it: a^2 / 24 r
  // and a^2 = 4 pi r^2 / 600 / (sqrt(3) / 4); RMS is within a factor of two of it. The diagonal is 2 sqrt(3) r.
  const double expected = 4 * 3.1416 / 600 / 0.433 / 24 / 3.464;
  EXPECT_GT(out->error.rms, expected / 2);
  EXPECT_LT(out->error.rms, expected * 2);
  EXPECT_NEAR(out->error.rms_back, out->error.rms, 0.2 * out->error.rms);
  EXPECT_GE(out->error.most, out->error.rms);
  EXPECT_EQ(out->error.beyond, 0U);
}

TEST(Reduce, OfACubeHasNoErrorEitherWay) {
  const auto out = reduced(testing::cube(30), {.triangles = 40, .map_side = 128});
  ASSERT_TRUE(out);
  EXPECT_LE(out->mesh.triangles.size(), 40U);
  EXPECT_LT(out->error.rms, 3e-5);  // eps of least_point draws corners off
  EXPECT_LT(out->error.rms_back, 3e-5);
  EXPECT_LT(out->normal_degrees, 1);
}

TEST(Reduce, ShowsThroughTheMapTheNormalsThatTheMeshHasLost) {
  for (const bool clustered : {false, true}) {
    const Model model = testing::sphere(100);  // 120,000 triangles
    Threads threads(2);
    const TriangleSource source = testing::source_of(model);
    const Reduce params{.triangles = 300, .map_side = 512};
    const auto plan = clustered ? clustering(1000, 512) : *plan_reduction(source, params);
    const auto out = reduce(source, plan, params, threads);
    ASSERT_TRUE(out);
    EXPECT_LE(out->mesh.triangles.size(), 300U);
    // Issue 5 allows 5 degrees. A smooth ball leaves .25 of 8 bits and .4 of its own facets.
    EXPECT_LT(out->normal_degrees, 1.0);
    EXPECT_GT(out->plain_normal_degrees, 1.5 * out->normal_degrees);
  }
}

TEST(Reduce, SamplesLargeTrianglesAsDenselyAsTexels) {
  // Twelve thousand triangles beside two that cover most of the model: none of their texels is left to diffusion.
  Model model = testing::sheet(1, 1, [](double u, double v) { return Vec3d{u, v, 0}; });
  append(model, testing::sheet(60, 60, [](double u, double v) { return Vec3d{1 + 0.1 * u, 0.1 * v, 0}; }));
  const auto out = reduced(model, {.triangles = 100, .map_side = 256});
  ASSERT_TRUE(out);
  EXPECT_LT(out->maps.filled, 0.02);
}

TEST(Reduce, CarriesColoursIntoTheirTexels) {
  Model model = testing::sheet(80, 80, [](double u, double v) { return Vec3d{u, v, 0}; });
  for (const Vec3d& p : model.position) model.color.push_back(p.x < 0.5 ? Vec3f{1, 0, 0} : Vec3f{0, 0, 1});
  const auto out = reduced(model, {.triangles = 50, .map_side = 128});
  ASSERT_TRUE(out);
  const Mesh& mesh = out->mesh;
  for (const Triangle& t : mesh.triangles) {
    const Vec3f p = (mesh.position[t[0]] + mesh.position[t[1]] + mesh.position[t[2]]) / 3.0F;
    const float u = (mesh.uv0[t[0]].x + mesh.uv0[t[1]].x + mesh.uv0[t[2]].x) / 3;
    const float v = (mesh.uv0[t[0]].y + mesh.uv0[t[1]].y + mesh.uv0[t[2]].y) / 3;
    if (std::abs(p.x) < 0.05F) continue;  // beside the seam of colours
    const std::size_t texel = 3 * (static_cast<std::size_t>(v * 128) * 128 + static_cast<std::size_t>(u * 128));
    EXPECT_EQ(out->maps.color[texel], p.x < 0 ? 255 : 0);
    EXPECT_EQ(out->maps.color[texel + 2], p.x < 0 ? 0 : 255);
  }
}

TEST(Reduce, GivesTheSameBytesForAnyNumberOfThreads) {
  Model model = testing::sphere(110);  // three batches
  for (const Vec3d& p : model.position) model.color.push_back(to_float(p * 0.5 + Vec3d{0.5, 0.5, 0.5}));
  const TriangleSource source = testing::source_of(model);
  const Reduce params{.triangles = 500, .map_side = 256};
  for (const ReducePlan& plan : {clustering(1500, 256), *plan_reduction(source, params)}) {
    Threads one(1), four(4);
    const auto a = reduce(source, plan, params, one), b = reduce(source, plan, params, four);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->mesh.position, b->mesh.position);
    EXPECT_EQ(a->mesh.triangles, b->mesh.triangles);
    EXPECT_EQ(a->maps.normal, b->maps.normal);
    EXPECT_EQ(a->maps.color, b->maps.color);
    EXPECT_EQ(a->error.rms, b->error.rms);
    EXPECT_EQ(a->error.rms_back, b->error.rms_back);
  }
}

TEST(Reduce, OfAFlatModelAndOfOneTriangleIsFine) {
  const auto flat = reduced(testing::sheet(40, 40,
                                           [](double u, double v) {
                                             return Vec3d{u, v, 7};
                                           }),
                            {.triangles = 8});
  ASSERT_TRUE(flat);
  EXPECT_LE(flat->mesh.triangles.size(), 8U);
  EXPECT_LT(flat->error.rms, 1e-6);
  const auto one = reduced({.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}, .color = {}},
                           {.triangles = 100});
  ASSERT_TRUE(one);
  EXPECT_EQ(one->mesh.triangles.size(), 1U);
}

TEST(Reduce, OfNothingButDegenerateTrianglesSaysSo) {
  const auto out =
      reduced({.position = {{1, 2, 3}, {1, 2, 3}, {4, 5, 6}}, .triangles = {{0, 1, 2}, {0, 0, 2}}, .color = {}},
              {.triangles = 1, .map_side = 0});
  if (out) {
    EXPECT_EQ(out->error.rms, 0);  // a triangle without area may stay: it is on the model
  } else {
    EXPECT_EQ(out.error().code, "nothing_left");
  }
}

TEST(Reduce, MakesAFinerMapThanAskedForWhereItsChartsNeedIt) {
  Model model;  // a thousand cubes, six charts each
  for (int i = 0; i < 1000; ++i) {
    Model one = testing::cube(2);
    for (Vec3d& p : one.position) p = p * 0.3 + Vec3d{double(i % 10), double(i / 10 % 10), double(i / 100)};
    append(model, one);
  }
  const TriangleSource source = testing::source_of(model);
  Threads threads(2);
  for (const std::uint64_t megabytes : {4096, 128}) {
    const Reduce params{.triangles = 20'000, .map_side = 64, .memory_bytes = megabytes << 20};
    auto plan = plan_reduction(source, params);
    ASSERT_TRUE(plan);
    if (megabytes == 128) plan->most_map_side = 128;
    const auto out = reduce(source, *plan, params, threads);
    ASSERT_TRUE(out);
    EXPECT_EQ(out->map_left_out, megabytes == 128);
    EXPECT_EQ(out->maps.side > 64, megabytes != 128);
  }
}

TEST(Reduce, LeavesAModelAloneThatIsSmallEnough) {
  const auto out = reduced(testing::cube(2), {.triangles = 48, .map_side = 64});
  ASSERT_TRUE(out);
  EXPECT_EQ(out->mesh.triangles.size(), 48U);
  EXPECT_EQ(out->maps.side, 0);
  EXPECT_LT(out->error.rms, 1e-7);  // float positions
}

TEST(Reduce, KeepsTheBodyOfAScanWithSpecks) {
  Model model = testing::sphere(60);
  for (int i = 0; i < 100; ++i) {
    Model speck = testing::cube(1);
    for (Vec3d& p : speck.position) p = p * 1e-4 + Vec3d{1.5, 0.02 * i - 1, 0.5};
    append(model, speck);
  }
  const TriangleSource source = testing::source_of(model);
  const Reduce params{.triangles = 500, .map_side = 0};
  for (const ReducePlan& plan : {clustering(1500, 0), *plan_reduction(source, params)}) {
    Threads threads(2);
    const auto out = reduce(source, plan, params, threads);
    ASSERT_TRUE(out);
    EXPECT_LE(out->mesh.triangles.size(), 500U);
    EXPECT_LT(out->error.rms, 0.005);
  }
}

TEST(ReducePlan, TakesLessThanItsLimitOrSaysWhatWouldDo) {
  TriangleSource source{.name = "scan.ply", .bytes = 1ULL << 32, .triangles = 50'000'000, .vertices = 25'000'000};
  for (const std::uint64_t megabytes : {128, 256, 512, 4096}) {
    const Reduce params{.triangles = 100'000, .memory_bytes = megabytes << 20};
    const auto plan = plan_reduction(source, params);
    if (plan) {
      EXPECT_LE(plan->memory_bytes, params.memory_bytes);
      EXPECT_FALSE(plan->in_core);
      EXPECT_GE(2 * plan->vertices, params.triangles);
    } else {
      EXPECT_EQ(plan.error().code, "memory_limit");
      EXPECT_LE(megabytes, 128U);
    }
  }
  source.triangles = 100'000;
  EXPECT_TRUE(plan_reduction(source, {.triangles = 1000})->in_core);
  EXPECT_TRUE(plan_reduction(source, {.triangles = 100'000})->unchanged);
}

}  // namespace
}  // namespace kiln
