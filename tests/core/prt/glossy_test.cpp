// Transfer matrices and their compression.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/prt/glossy_bake.h"
#include "core/prt/glossy_matrix.h"
#include "core/prt/interreflection.h"
#include "core/prt/lobe_table.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

constexpr int kOrder = 5;
constexpr std::size_t kCount = sh_count(kOrder);

Transfer black_transfer(const Scene& scene, int channels = 1, bool fixed = false) {
  Transfer out{kOrder, channels, fixed, {}};
  out.coefficients.assign(scene.mesh.position.size() * out.stride(), 0.0F);
  return out;
}

std::vector<double> random_light(std::uint64_t seed) {
  Random random(seed, 0);
  std::vector<double> out;
  for (std::size_t i = 0; i < kCount; ++i) out.push_back(2 * random.uniform_double() - 1);
  return out;
}

double light_along(const std::vector<double>& light, const Vec3d& w) {
  std::array<double, kCount> y;
  evaluate_sh(kOrder, w, y.data());
  double sum = 0;
  for (std::size_t i = 0; i < kCount; ++i) sum += light[i] * y[i];
  return sum;
}

std::vector<double> times(const std::vector<float>& matrix, const std::vector<double>& light,
                          std::size_t inputs = kCount) {
  std::vector<double> out(kCount);
  for (std::size_t o = 0; o < kCount; ++o) {
    for (std::size_t i = 0; i < kCount; ++i) out[o] += matrix[o * inputs + i] * light[i];
  }
  return out;
}

/// Coefficients of arriving(w) over the half space of n: quadrature by many directions.
template <class F>
std::vector<double> project_half_space(const Vec3d& n, int degree, const F& arriving) {
  std::vector<double> out(kCount);
  std::array<double, kCount> y;
  for (const SphereNode& node : sphere_quadrature(degree)) {
    const double height = dot(node.direction, n);
    const double radiance = height > 0 ? arriving(node.direction) : 0;
    evaluate_sh(kOrder, node.direction, y.data());
    for (std::size_t i = 0; i < kCount; ++i) out[i] += node.weight * radiance * y[i];
  }
  return out;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

double size(const std::vector<double>& a) { return distance(a, std::vector<double>(a.size())); }

std::vector<float> matrix_of(const Scene& scene, const Transfer& light, const TransferPoint& point,
                             GlossyMatrix params) {
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const GlossyMatrixBaker baker(tracer, light, params);
  std::vector<float> out(baker.stride());
  baker.bake(point, out.data());
  return out;
}

TransferPoint point_at(const Vec3f& position, const Vec3f& normal) { return {position, normal, position, normal}; }

Scene floor_scene(const Vec3f& across, const Vec3f& up) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, (across + up) * -0.5F, across, up, 2, 2);
  return scene;
}

TEST(GlossyMatrix, OpenPointSeesTheLightOfItsHalfSpace) {
  Random random(3, 1);
  for (int trial = 0; trial < 5; ++trial) {
    const Vec3f n = normalized(Vec3f{random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F});
    const Basis<float> basis = basis_around(n);
    const Scene scene = floor_scene(basis.x * 0.5F, basis.y * 0.5F);
    const auto matrix =
        matrix_of(scene, black_transfer(scene), point_at({0, 0, 0}, n), {.order = kOrder, .channels = 1});
    const std::vector<double> light = random_light(11 + static_cast<std::uint64_t>(trial));
    // Light ends at the horizon, where quadrature by 1600 points around leaves 1e-3.
    const auto truth = project_half_space(to_double(n), 1600, [&](const Vec3d& w) { return light_along(light, w); });
    EXPECT_LT(distance(times(matrix, light), truth), 2e-3 * size(truth));
  }
}

TEST(GlossyMatrix, AConstantSkyOverAnOpenPointIsMirroredAsItIs) {
  const Scene scene = floor_scene({0.5F, 0, 0}, {0, 0.5F, 0});
  const auto matrix =
      matrix_of(scene, black_transfer(scene), point_at({0, 0, 0}, {0, 0, 1}), {.order = kOrder, .channels = 1});
  std::vector<double> light(kCount);
  light[0] = 2 * std::sqrt(std::numbers::pi);
  std::vector<Vec3d> arriving;
  for (const double x : times(matrix, light)) arriving.push_back({x, x, x});
  const LobeTable table = make_lobe_table(kOrder);
  for (const double nv : {0.1, 0.5, 0.9}) {
    const Vec3d v{0, std::sqrt(1 - nv * nv), nv};
    for (const double roughness : {0.0, 0.5, 1.0}) {
      const Vec3d shown = reflected_light(lobe_at(table, nv, roughness), {0, 0, 1}, v, arriving.data());
      EXPECT_NEAR(shown.x, 1, 1e-5) << nv << ' ' << roughness;  // float rounding of the closed form
    }
  }
}

/// A floor in z = 0 and a wall in the plane x = d, nearly infinite.
Scene wall_scene(float d, std::uint32_t part) {
  Scene scene = testing::empty_scene();
  testing::add_part(scene, {0.5F, 0.25F, 0.125F});
  testing::add_grid(scene, {-0.5F, -0.5F, 0}, {1, 0, 0}, {0, 1, 0}, 2, 2);
  testing::add_grid(scene, {d, -0.5F, 0}, {0, 0, 0.5F}, {0, 1, 0}, 1, 1, part);  // faces -x
  return scene;
}

/// Whether a ray from the origin meets that wall.
bool hits_wall(float d, const Vec3d& w) {
  if (w.x <= 0) return false;
  const double t = d / w.x;
  return std::abs(t * w.y) < 0.5 && t * w.z < 0.5 && t * w.z > 0;
}

TEST(GlossyMatrix, BlackWallTakesAwayHalfTheSky) {
  constexpr float kD = 0.01F;
  const Scene scene = wall_scene(kD, 0);
  const auto matrix = matrix_of(scene, black_transfer(scene), point_at({0, 0, 0}, {0, 0, 1}),
                                {.order = kOrder, .channels = 1, .samples = 16384});
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const auto light = random_light(seed);
    const auto truth = project_half_space(
        {0, 0, 1}, 1600, [&](const Vec3d& w) { return hits_wall(kD, w) ? 0.0 : light_along(light, w); });
    // 16384 stratified rays at one straight edge: about N^-3/4 = 7e-4; the quadrature at horizon and edge: a few 1e-3.
    EXPECT_LT(distance(times(matrix, light), truth), 8e-3 * size(truth)) << seed;
  }
}

TEST(GlossyMatrix, WallSendsBackItsDiffuseLightInItsColour) {
  constexpr float kD = 0.01F;
  const Scene scene = wall_scene(kD, 1);
  Transfer light = black_transfer(scene, 3);
  // Every vertex of the wall leaves, per unit of coefficient 2, radiance 1 times its albedo.
  for (std::size_t v = 9; v < light.vertices(); ++v) {
    for (std::size_t c = 0; c < 3; ++c) light.coefficients[v * light.stride() + c * kCount + 2] = 1;
  }
  const auto matrix = matrix_of(scene, light, point_at({0, 0, 0}, {0, 0, 1}),
                                {.order = kOrder, .channels = 3, .reflected = true, .samples = 16384});
  std::vector<double> only_two(kCount);
  only_two[2] = 1;
  const std::array<double, 3> albedo{0.5, 0.25, 0.125};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto truth = project_half_space(
        {0, 0, 1}, 1600, [&](const Vec3d& w) { return hits_wall(kD, w) ? albedo[c] : light_along(only_two, w); });
    const std::vector<float> part(matrix.begin() + static_cast<std::ptrdiff_t>(c * kCount * kCount),
                                  matrix.begin() + static_cast<std::ptrdiff_t>((c + 1) * kCount * kCount));
    EXPECT_LT(distance(times(part, only_two), truth), 8e-3 * size(truth)) << c;  // as above
  }
}

TEST(GlossyMatrix, LampsColumnHoldsWhatLampsEmitAndWhatTheyLight) {
  constexpr float kD = 0.01F;
  Scene scene = wall_scene(kD, 1);
  scene.materials[1].emission = {2, 3, 4};
  Transfer light = black_transfer(scene, 3, true);
  for (std::size_t v = 9; v < light.vertices(); ++v) {
    for (std::size_t c = 0; c < 3; ++c) light.coefficients[v * light.stride() + c * (kCount + 1) + kCount] = 8;
  }
  const auto matrix = matrix_of(scene, light, point_at({0, 0, 0}, {0, 0, 1}),
                                {.order = kOrder, .channels = 3, .fixed = true, .reflected = true, .samples = 16384});
  const std::array<double, 3> radiance{2 + 8 * 0.5, 3 + 8 * 0.25, 4 + 8 * 0.125};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto truth =
        project_half_space({0, 0, 1}, 1600, [&](const Vec3d& w) { return hits_wall(kD, w) ? radiance[c] : 0.0; });
    std::vector<double> column(kCount);
    for (std::size_t o = 0; o < kCount; ++o) column[o] = matrix[(c * kCount + o) * (kCount + 1) + kCount];
    EXPECT_LT(distance(column, truth), 8e-3 * size(truth)) << c;  // as above
  }
}

TEST(GlossyMatrix, BackOfASingleSidedWallIsBlack) {
  constexpr float kD = 0.01F;
  Scene scene = wall_scene(kD, 1);
  for (std::size_t t = 8; t < scene.mesh.triangles.size(); ++t)
    std::swap(scene.mesh.triangles[t][1], scene.mesh.triangles[t][2]);
  for (std::size_t v = 9; v < scene.mesh.normal.size(); ++v) scene.mesh.normal[v] = {1, 0, 0};
  Transfer light = black_transfer(scene);
  for (std::size_t v = 9; v < light.vertices(); ++v) light.coefficients[v * light.stride()] = 1;
  const GlossyMatrix params{.order = kOrder, .channels = 1, .reflected = true};
  const TransferPoint point = point_at({0, 0, 0}, {0, 0, 1});
  EXPECT_EQ(matrix_of(scene, light, point, params), matrix_of(scene, black_transfer(scene), point, params));
}

TEST(GlossyMatrix, TurnsWithTheScene) {
  constexpr float kD = 0.01F;
  const Scene scene = wall_scene(kD, 0);
  const Vec3f z = normalized(Vec3f{1, -2, 0.5F});
  const Basis<float> turn = basis_around(z);
  Scene turned = scene;
  for (Vec3f& p : turned.mesh.position) p = turn.to_world(p) * 0.55F;  // stays in the cube; lengths do not matter
  for (Vec3f& n : turned.mesh.normal) n = turn.to_world(n);
  const GlossyMatrix params{.order = kOrder, .channels = 1, .samples = 16384};
  const auto plain = matrix_of(scene, black_transfer(scene), point_at({0, 0, 0}, {0, 0, 1}), params);
  const auto other = matrix_of(turned, black_transfer(turned), point_at({0, 0, 0}, z), params);
  const auto light = random_light(5);
  std::vector<float> light_turned(light.begin(), light.end());
  rotate_sh(kOrder, turn, light_turned.data(), light_turned.data());
  std::vector<float> expected(kCount);
  std::ranges::copy(times(plain, light), expected.begin());
  rotate_sh(kOrder, turn, expected.data(), expected.data());
  const auto found = times(other, {light_turned.begin(), light_turned.end()});
  // Other azimuths and sets: the noise of two draws of 16384 rays.
  EXPECT_LT(distance(found, {expected.begin(), expected.end()}), 4e-3 * size(found));
}

TEST(GlossyMatrix, NoLightIsMadeUnderAConstantSky) {
  const Scene scene = testing::room_scene();
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const auto points = vertex_points(scene.mesh);
  const Transfer light = bake_interreflection(
      tracer, scene.mesh, bake_direct_transfer(tracer, points, {.order = kOrder, .samples = 256}, threads), {},
      {.order = kOrder, .bounces = 4, .samples = 64}, threads);
  const GlossyMatrixBaker baker(tracer, light,
                                {.order = kOrder, .channels = light.channels, .reflected = true, .samples = 256});
  std::vector<float> matrix(baker.stride());
  for (const TransferPoint& p : points) {
    baker.bake(p, matrix.data());
    // The mean of the arriving light over all directions, half of them dark: all of it is sky of radiance 1 or surfaces
    // of albedo below 1 lit by no more.
    EXPECT_GE(matrix[0], -1e-4);
    EXPECT_LE(matrix[0], 0.5 + 1e-4);
  }
}

struct Baked {
  Transfer light;
  GlossyBaked glossy;
  std::vector<std::vector<float>> exact;  // matrices
};

Baked bake_column(double left_out, int threads_count = 2) {
  const Scene scene = testing::column_scene();
  Threads threads(threads_count);
  const Tracer tracer(scene, threads);
  const auto points = vertex_points(scene.mesh);
  Baked out;
  out.light = bake_interreflection(tracer, scene.mesh,
                                   bake_direct_transfer(tracer, points, {.order = kOrder, .samples = 256}, threads), {},
                                   {.order = kOrder, .bounces = 2, .samples = 64}, threads);
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    if (v % 3 != 1) vertices.push_back(v);
  }
  const GlossyMatrix params{.order = kOrder, .channels = out.light.channels, .reflected = true, .samples = 256};
  out.glossy = bake_glossy(
      tracer, out.light, vertices,
      {.matrix = params,
       .rank = {.band_power = std::vector<double>(kOrder, 4 * std::numbers::pi), .left_out = left_out, .most = 512}},
      threads);
  const GlossyMatrixBaker baker(tracer, out.light, params);
  for (const auto v : vertices) {
    out.exact.emplace_back(baker.stride());
    baker.bake(points[v], out.exact.back().data());
  }
  return out;
}

double worst_difference(const Baked& baked) {
  const GlossyTransfer& g = baked.glossy.transfer;
  double worst = 0;
  for (std::size_t n = 0; n < g.vertices.size(); ++n) {
    for (std::size_t s = 0; s < g.stride(); ++s) {
      double sum = g.components.mean()[s];
      for (std::size_t k = 0; k < g.rank(); ++k) sum += double{g.weights[n * g.rank() + k]} * g.components.row(k)[s];
      worst = std::max(worst, std::abs(sum - baked.exact[n][s]));
    }
  }
  return worst;
}

TEST(GlossyBake, AllComponentsTogetherGiveTheMatricesBack) {
  const Baked baked = bake_column(0);
  EXPECT_LT(baked.glossy.left_out, 1e-4);    // float rounding
  EXPECT_LT(worst_difference(baked), 1e-4);  // as well
}

TEST(GlossyBake, LeavesOutAboutAsMuchAsAllowedAndSaysHowMuch) {
  const Baked baked = bake_column(0.05), finer = bake_column(0.01);
  std::printf("rank %zu at 5 %%, %zu at 1 %%; noise %.4f\n", baked.glossy.transfer.rank(), finer.glossy.transfer.rank(),
              baked.glossy.noise);
  EXPECT_LT(baked.glossy.transfer.rank(), finer.glossy.transfer.rank());
  // Every vertex is a sample here, but samples count alike and the figure by area.
  EXPECT_LT(baked.glossy.left_out, 0.07);
  EXPECT_GT(baked.glossy.left_out, 0.02);
  EXPECT_LT(finer.glossy.left_out, 0.014);
  EXPECT_GT(worst_difference(baked), worst_difference(finer));
}

TEST(GlossyBake, ThreadCountChangesNotOneBit) {
  const Baked a = bake_column(0.02, 1), b = bake_column(0.02, 3);
  EXPECT_EQ(a.glossy.transfer.weights, b.glossy.transfer.weights);
  EXPECT_EQ(a.glossy.transfer.components.rows, b.glossy.transfer.components.rows);
  EXPECT_EQ(a.glossy.left_out, b.glossy.left_out);
}

TEST(GlossyTransfer, LitComponentsGiveWhatTheMatrixTimesTheLightGives) {
  const Baked baked = bake_column(0);
  const GlossyTransfer& g = baked.glossy.transfer;
  const auto light = random_light(9);
  std::vector<Vec3f> rgb;
  for (const double x : light)
    rgb.push_back({static_cast<float>(x), static_cast<float>(2 * x), static_cast<float>(-x)});
  const LitComponents lit = light_components(g, rgb, true);
  std::vector<Vec3d> arriving(kCount);
  for (std::size_t n = 0; n < g.vertices.size(); n += 7) {
    incident_light(g, lit, n, arriving.data());
    const auto expected = times(baked.exact[n], light);
    for (std::size_t o = 0; o < kCount; ++o)
      EXPECT_NEAR(arriving[o].x, expected[o], 1e-3);  // float rounding of 400 terms
  }
  EXPECT_EQ(g.find(g.vertices[5]), 5U);
  EXPECT_EQ(g.find(1), GlossyTransfer::kNoMatrix);
}

}  // namespace
}  // namespace kiln
