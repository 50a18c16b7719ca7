// Bad triangles give right light: needles, overlaps, T-junctions, edges of many faces, lonely vertices, one triangle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/artifact/baked_scene.h"
#include "core/bake/bake.h"
#include "core/base/random.h"
#include "core/prt/direct_transfer.h"
#include "core/sphere/sh.h"
#include "core/trace/surface.h"
#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/extremes/random_bake.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln::test {
namespace {

constexpr float kY00 = 0.28209479F;

/// Something above every point, too small to be seen: rays are traced, and none may meet the points' own surface.
void add_speck(Scene& scene, const Vec3f& at, const Vec3f& up) {
  const Basis<float> b = basis_around(up);
  kiln::testing::add_grid(scene, at, b.x * 1e-5F, b.y * 1e-5F, 1, 1);
}

std::vector<float> under_constant_sky(const Scene& scene, std::span<const TransferPoint> points) {
  Threads threads(2);
  const Tracer tracer(scene, threads);
  TransferStats stats;
  std::vector<float> out = bake_direct_transfer(tracer, points, {.order = 1, .samples = 256}, threads, &stats);
  EXPECT_GT(stats.rays, 0U);
  for (float& x : out) x /= kY00;
  return out;
}

/// A floor of long thin triangles in a plane askew, at most 50 deep: strips (cut along their diagonal) or caps (the
/// third corner over the middle of the longest edge).
Scene needle_floor(double height, bool caps, std::uint64_t seed) {
  Scene scene = kiln::testing::empty_scene();
  const Vec4<double> turn = random_turn(seed);
  const auto corner = [&](double x, double z) {
    scene.mesh.position.push_back(to_float(turned(turn, {x, 0, z}) + Vec3d{0.1, -0.07, 0.03}));
    scene.mesh.normal.push_back(to_float(turned(turn, {0, 1, 0})));
    return static_cast<std::uint32_t>(scene.mesh.position.size() - 1);
  };
  for (int i = 0; i < 50 && 0.3 - i * height > -0.3; ++i) {
    const double near = 0.3 - i * height, far = near - height;
    const std::uint32_t a = corner(-0.3, near), b = corner(0.3, near), c = corner(caps ? 0.01 : 0.3, far);
    scene.mesh.triangles.push_back({a, b, c});
    if (!caps) scene.mesh.triangles.push_back({a, c, corner(-0.3, far)});
  }
  scene.mesh.part.assign(scene.mesh.triangles.size(), 0);
  const Vec3f up = scene.mesh.normal[0];
  add_speck(scene, Vec3f{0.1F, -0.07F, 0.03F} + up * 0.2F, up);
  return scene;
}

std::vector<TransferPoint> floor_vertices(const Scene& scene) {
  std::vector<TransferPoint> points = vertex_points(scene.mesh);
  points.resize(points.size() - 4);  // without the speck's
  return points;
}

std::vector<TransferPoint> centroids(const Scene& scene) {
  std::vector<TransferPoint> points;
  for (std::size_t i = 0; i + 2 < scene.mesh.triangles.size(); ++i) {
    const Triangle& t = scene.mesh.triangles[i];
    const Vec3f middle = (scene.mesh.position[t[0]] + scene.mesh.position[t[1]] + scene.mesh.position[t[2]]) / 3.0F;
    points.push_back({middle, scene.mesh.normal[t[0]], middle, scene.mesh.normal[t[0]]});
  }
  return points;
}

TEST(Triangles, ANeedleDoesNotShadeItself) {
  for (const double height : {0.2, 2e-3, 6e-4, 2e-4, 6e-5, 6e-6}) {  // of 0.6: aspects from 3 to 100,000
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Scene strips = needle_floor(height, false, seed);
      for (const float x : under_constant_sky(strips, centroids(strips))) EXPECT_GE(x, 1 - 1e-5F) << height;
      for (const float x : under_constant_sky(strips, floor_vertices(strips))) EXPECT_GE(x, 1 - 1e-5F) << height;
      // The plane of a cap is known from edges of half its length: 6e-8 (0.3)^2 / (0.6 height) at a distance of 0.3 is
      // less than the lift of 1.9e-6 down to a height of 1e-3.
      const Scene caps = needle_floor(height, true, seed);
      if (height > 5e-4) {
        for (const float x : under_constant_sky(caps, centroids(caps))) EXPECT_GE(x, 1 - 1e-5F) << height;
      }
      for (const float x : under_constant_sky(caps, floor_vertices(caps))) EXPECT_GE(x, 0.95F) << height;
    }
  }
}

TEST(Triangles, AHitHasTheBarycentricsOfItsOwnCorners) {
  const Scene scene = kiln::testing::random_scene(11, 60);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  int hits = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(5, i);
    const auto cube = [&] { return Vec3f{random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F}; };
    const Vec3f from = cube() * 2.0F, direction = normalized(cube());
    const Hit hit = tracer.closest(from, direction, 4);
    if (!hit) continue;
    ++hits;
    // 4 ulps of a distance below 2, and as much for weights.
    EXPECT_LT(length(surface_point(scene, hit.triangle, hit.u, hit.v).position - (from + direction * hit.t)), 4e-6F);
  }
  EXPECT_GT(hits, 200);
}

TEST(Triangles, SheetsInOnePlaneDoNotShadeEachOther) {
  for (const bool back_to_back : {false, true}) {
    Scene scene = kiln::testing::empty_scene();
    kiln::testing::add_grid(scene, {-0.4F, 0.1F, 0.3F}, {0.5F, 0, 0}, {0, 0, -0.6F}, 3, 3);
    const Vec3f across{0.5F, 0, 0}, up{0, 0, -0.6F};
    kiln::testing::add_grid(scene, {-0.1F, 0.1F, 0.3F}, back_to_back ? up : across, back_to_back ? across : up, 2, 5);
    const std::size_t count = scene.mesh.position.size();
    add_speck(scene, {0, 0.4F, 0}, {0, 1, 0});
    add_speck(scene, {0, -0.4F, 0}, {0, -1, 0});
    const std::vector<float> light = under_constant_sky(scene, vertex_points(scene.mesh));
    for (std::size_t v = 0; v < count; ++v) EXPECT_GE(light[v], 1 - 1e-5F) << back_to_back << ' ' << v;
  }
}

TEST(Triangles, NoLightComesInAtATJunction) {
  // A closed room whose walls are cut differently: along every edge the vertices of one wall lie between the other's.
  Scene scene = kiln::testing::empty_scene();
  const Vec3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, low{-0.5F, -0.5F, -0.5F}, high{0.5F, 0.5F, 0.5F};
  kiln::testing::add_grid(scene, low, z, x, 3, 7);
  kiln::testing::add_grid(scene, low, x, y, 5, 2);
  kiln::testing::add_grid(scene, low, y, z, 11, 4);
  kiln::testing::add_grid(scene, high, -x, -z, 6, 13);
  kiln::testing::add_grid(scene, high, -y, -x, 9, 8);
  kiln::testing::add_grid(scene, high, -z, -y, 10, 1);
  double sum = 0;
  const std::vector<float> light = under_constant_sky(scene, vertex_points(scene.mesh));
  for (const float t : light) {
    EXPECT_LE(t, 3.0F / 256);  // as at other seams: direct_transfer_test
    sum += t;
  }
  EXPECT_LE(sum / static_cast<double>(light.size()), 1e-3);
}

TEST(Triangles, BetweenManyLeavesOnOneEdgeAPointSeesItsWedge) {
  // Leaves of height 2h around a vertical edge: close to the edge's middle a point on one leaf sees the sky only
  // between its leaf and the next, at an angle of 2 pi / n: (1 - cos angle) / 2 of an endless wedge's cosine-weighted
  // sky.
  for (const int leaves : {3, 4, 6}) {
    Scene scene = kiln::testing::empty_scene();
    for (int i = 0; i < leaves; ++i) {
      const auto phi = static_cast<float>(2 * 3.14159265358979 * i / leaves);
      kiln::testing::add_grid(scene, {0, -0.5F, 0}, {0, 1, 0}, {0.45F * std::cos(phi), 0, 0.45F * std::sin(phi)}, 1, 1);
    }
    const Vec3f at{1e-3F, 0, 0}, normal = scene.mesh.normal[0];
    const TransferPoint point{at, normal, at, normal};
    const double angle = 2 * 3.14159265358979 / leaves;
    // Edges end 0.45 away: 1e-3 / 0.45. 256 rays: 0.5 / 256^0.75 = 8e-3 at 1 sigma for the worst stratification.
    EXPECT_NEAR(under_constant_sky(scene, std::span(&point, 1))[0], (1 - std::cos(angle)) / 2, 0.02) << leaves;
  }
}

TEST(Triangles, LonelyVerticesAndUselessTrianglesChangeNotOneBit) {
  const auto import = [](bool spoilt) {
    Sample s;
    std::vector<float> positions = cube_positions();
    std::vector<std::uint32_t> indices = cube_indices();
    if (spoilt) {
      positions.insert(positions.end(), {99, 99, 99, -77, 0, 5});
      const std::vector<std::uint32_t> twice(indices.begin(), indices.begin() + 6);
      indices.insert(indices.end(), twice.begin(), twice.end());
      indices.insert(indices.end(), {3, 3, 5, 1, 1, 1});
    }
    s.positions(positions);
    s.indices(indices);
    return import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1")));
  };
  const auto clean = import(false), spoilt = import(true);
  ASSERT_TRUE(clean && spoilt);
  EXPECT_EQ(clean->mesh.position, spoilt->mesh.position);
  EXPECT_EQ(clean->mesh.normal, spoilt->mesh.normal);
  EXPECT_EQ(clean->mesh.triangles, spoilt->mesh.triangles);
  EXPECT_EQ(clean->frame.scale, spoilt->frame.scale);
}

TEST(Triangles, ASingleTriangleIsBakedToTheClosedForm) {
  Sample s;
  s.positions(kTriangle);
  BakeInput input{.scene = {.name = "scene.glb", .main = s.glb(one_node("\"attributes\":{\"POSITION\":0}"))}};
  input.recipe = *parse_recipe(R"({"environment":{"constant":[1,1,1]},"certificate":false})");
  Threads threads(2);
  const auto output = bake(input, {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto baked = read_baked_glb(file_of(*output, "scene.glb"));
  ASSERT_TRUE(baked);
  std::vector<float> expected(static_cast<std::size_t>(sh_count(baked->transfer.order)));
  clamped_cosine_transfer(baked->transfer.order, {0, 0, 1}, expected.data());
  ASSERT_GE(baked->transfer.vertices(), 3U);
  for (std::size_t v = 0; v < baked->transfer.vertices(); ++v) {
    // Rows have 2^-13 of the largest of four (at most 0.33), then 16 bits of their band.
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(baked->transfer.at(v, 0)[i], expected[i], 6e-5);
  }
}

}  // namespace
}  // namespace kiln::test
