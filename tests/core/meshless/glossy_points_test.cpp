// Transfer matrices on points against those at vertices, and bad input.

#include "core/meshless/glossy_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include "core/prt/interreflection.h"
#include "tests/core/meshless/odd_scenes.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

constexpr int kOrder = 4;

struct Lit {
  Scene scene;
  Transfer light;
  std::vector<std::uint32_t> vertices;
};

Lit lit(Scene scene) {
  Lit out{std::move(scene), {}, {}};
  Threads threads(2);
  const Tracer tracer(out.scene, threads);
  const std::vector<TransferPoint> points = vertex_points(out.scene.mesh);
  out.light = bake_interreflection(tracer, out.scene.mesh,
                                   bake_direct_transfer(tracer, points, {.order = kOrder, .samples = 256}, threads), {},
                                   {.order = kOrder, .bounces = 1, .samples = 64}, threads);
  out.vertices.resize(points.size());
  std::iota(out.vertices.begin(), out.vertices.end(), 0U);
  return out;
}

GlossyPoints params_of(const Lit& in, float eps, std::uint64_t wanted) {
  GlossyPoints out;
  out.bake.matrix = {.order = kOrder, .channels = in.light.channels, .reflected = true, .samples = 256};
  out.bake.rank = {.band_power = std::vector<double>(kOrder, 4 * std::numbers::pi), .left_out = 0.002, .most = 512};
  out.points.wanted = wanted;
  out.eps = eps;
  return out;
}

struct OnPoints {
  GlossyBaked baked;
  GlossyPointStats stats;
};

OnPoints bake(const Lit& in, const GlossyPoints& params, int thread_count = 2) {
  Threads threads(thread_count);
  const Tracer tracer(in.scene, threads);
  OnPoints out;
  out.baked = bake_glossy_on_points(tracer, in.light, in.vertices, params, threads, out.stats);
  return out;
}

std::vector<float> matrix_of(const GlossyTransfer& g, std::size_t n) {
  std::vector<float> out(g.components.mean(), g.components.mean() + g.stride());
  for (std::size_t k = 0; k < g.rank(); ++k) {
    for (std::size_t s = 0; s < g.stride(); ++s) out[s] += g.weights[n * g.rank() + k] * g.components.row(k)[s];
  }
  return out;
}

/// RMS over vertices and numbers, relative to that of the matrices of an open point.
double error_of(const Lit& in, const GlossyBaked& baked) {
  Threads threads(2);
  const Tracer tracer(in.scene, threads);
  const GlossyMatrixBaker exact(tracer, in.light,
                                {.order = kOrder, .channels = in.light.channels, .reflected = true, .samples = 2048});
  std::uint64_t rays = 0;
  const std::vector<TransferPoint> points = vertex_points(in.scene.mesh);
  double squared = 0, all = 0;
  for (std::size_t v = 0; v < in.vertices.size(); v += 3) {
    const std::vector<float> truth = exact.bake(std::span(&points[v], 1), threads, rays);
    const std::vector<float> own = matrix_of(baked.transfer, v);
    std::vector<float> open(truth.size());
    exact.open(points[v].normal, open.data());
    for (std::size_t s = 0; s < truth.size(); ++s) {
      squared += std::pow(own[s] - truth[s], 2);
      all += std::pow(open[s], 2);
    }
  }
  return std::sqrt(squared / all);
}

// Nothing rises above a face of a convex thing: its matrices are the closed form, and no point takes a ray.
TEST(GlossyPoints, ABoxInTheOpenHasOpenMatricesWithoutARay) {
  Scene scene = testing::empty_scene();
  testing::add_box(scene, {-0.3F, -0.5F, -0.4F}, {0.3F, 0.5F, 0.4F}, 3, false);
  const Lit in = lit(std::move(scene));
  const OnPoints out = bake(in, params_of(in, 0.1F, 2000));
  EXPECT_EQ(out.baked.rays, 0U);
  EXPECT_LT(out.stats.noise, 1e-6);                                    // float rounding
  EXPECT_LT(out.stats.computed.back(), out.stats.points.back() / 10);  // around what sees no other point: corners
  EXPECT_LT(error_of(in, out.baked), 2e-3);  // what the components leave out, by their own measure
}

/// A ball over a floor of 24 x 24 cells, whose matrices are asked for.
Lit ball_over_floor() {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, -0.2F, -0.5F}, {0, 0, 1}, {1, 0, 0}, 24, 24);
  const std::uint32_t ball = testing::add_part(scene, {0.5F, 0.5F, 0.5F});
  testing::add_sphere(scene, {0, 0, 0}, 0.15F, 10, ball);
  Lit out = lit(std::move(scene));
  out.vertices.resize(25 * 25);
  return out;
}

TEST(GlossyPoints, ErrorFallsWithEpsAndIsNearThatOfMatricesAtAllVertices) {
  const Lit in = ball_over_floor();
  Threads threads(2);
  const Tracer tracer(in.scene, threads);
  GlossyPoints params = params_of(in, 0, 2000);
  params.points.parts = {true, false};
  const double everywhere = error_of(in, bake_glossy(tracer, in.light, in.vertices, params.bake, threads));
  double before = 1;
  std::size_t matrices = 0;
  for (const float eps : {10.0F, 0.3F, 0.0F}) {
    params.eps = eps;
    const OnPoints out = bake(in, params);
    const double error = error_of(in, out.baked);
    std::printf("eps_T %.1f: %zu matrices for %zu vertices (%zu lone), noise %.3f, error %.4f; at vertices %.4f\n",
                double{eps}, out.stats.matrices(), in.vertices.size(), out.stats.alone, double{out.stats.noise}, error,
                everywhere);
    EXPECT_LT(error, before) << eps;
    EXPECT_GT(out.stats.matrices(), matrices);
    before = error, matrices = out.stats.matrices();
  }
  EXPECT_LT(before, 1.3 * everywhere);
}

TEST(GlossyPoints, ThreadCountChangesNotOneBit) {
  const Lit in = lit(testing::column_scene());
  const GlossyPoints params = params_of(in, 0.3F, 700);
  const OnPoints a = bake(in, params, 1), b = bake(in, params, 3);
  EXPECT_EQ(a.baked.transfer.weights, b.baked.transfer.weights);
  EXPECT_EQ(a.baked.transfer.components.rows, b.baked.transfer.components.rows);
  EXPECT_EQ(a.baked.left_out, b.baked.left_out);
  EXPECT_EQ(a.baked.noise, b.baked.noise);
  EXPECT_EQ(a.stats.computed, b.stats.computed);
}

TEST(GlossyPoints, OnlyPartsThatAreToHaveMatricesGetPoints) {
  Scene scene = testing::column_scene();
  const std::uint32_t ball = testing::add_part(scene, {0.5F, 0.5F, 0.5F});
  testing::add_sphere(scene, {0.3F, 0, 0.3F}, 0.05F, 8, ball);
  Lit in = lit(std::move(scene));
  std::erase_if(in.vertices, [&](std::uint32_t v) { return v < in.scene.mesh.triangles.front()[0]; });
  GlossyPoints params = params_of(in, 0.1F, 200);
  params.points.parts = {false, true};
  const double area = placed_area(params.points, in.scene);
  EXPECT_NEAR(area, 4 * std::numbers::pi * 0.05 * 0.05, 0.1 * area);  // a coarse ball
  const OnPoints out = bake(in, params);
  const std::uint32_t points = std::accumulate(out.stats.points.begin(), out.stats.points.end(), 0U);
  EXPECT_GT(points, 100U);
  EXPECT_LT(points, 300U);  // .7 A / R^2 is measured on smooth surfaces (points.h)
}

TEST(GlossyPoints, OneTriangleCoincidentSheetsAndAbsurdRadiiGiveMatrices) {
  for (const Scene& scene : testing::odd_scenes(40)) {
    const Lit in = lit(scene);
    for (const float radius : {0.0F, 1e4F, 0.05F}) {
      GlossyPoints params = params_of(in, 0.1F, 64);
      params.points.radius = radius;
      params.points.levels = radius > 0 ? 2 : 0;
      params.bake.matrix.samples = 32;
      const OnPoints out = bake(in, params);
      ASSERT_EQ(out.baked.transfer.vertices.size(), scene.mesh.position.size());
      for (const float w : out.baked.transfer.weights) ASSERT_TRUE(std::isfinite(w));
      EXPECT_TRUE(std::isfinite(out.baked.noise) && std::isfinite(out.baked.left_out));
    }
  }
}

}  // namespace
}  // namespace kiln
