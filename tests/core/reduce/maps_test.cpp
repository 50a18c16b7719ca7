#include <gtest/gtest.h>

#include "core/reduce/surface_maps.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

Atlas placed(const std::vector<Vec3d>& position, const std::vector<Triangle>& triangles, int side) {
  Atlas atlas = make_charts(position, triangles);
  EXPECT_TRUE(place_charts(atlas, side));
  return atlas;
}

Surface surface_of(const testing::Model& model) {
  Surface s;
  for (const Vec3d& p : model.position) s.position.push_back(p * 0.5);
  s.sample.resize(s.position.size());
  for (Sample& v : s.sample) v.weight = 1, v.color = {1, 1, 1};
  s.triangles = model.triangles;
  return s;
}

TEST(DeliveredMesh, HasRightHandedFramesThatFollowTheTexture) {
  const Surface s = surface_of(testing::sphere(6));
  const Atlas atlas = placed(s.position, s.triangles, 512);
  const Mesh mesh = delivered_mesh(s, &atlas, false);
  ASSERT_EQ(mesh.triangles.size(), s.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    // The derivative of the position along u, and against v, by the corners of the triangle.
    const Vec3d e1 = to_double(mesh.position[t[1]] - mesh.position[t[0]]);
    const Vec3d e2 = to_double(mesh.position[t[2]] - mesh.position[t[0]]);
    const double u1 = double{mesh.uv0[t[1]].x} - mesh.uv0[t[0]].x, u2 = double{mesh.uv0[t[2]].x} - mesh.uv0[t[0]].x;
    const double v1 = double{mesh.uv0[t[1]].y} - mesh.uv0[t[0]].y, v2 = double{mesh.uv0[t[2]].y} - mesh.uv0[t[0]].y;
    const double det = u1 * v2 - u2 * v1;
    ASSERT_NE(det, 0);
    const Vec3d along_u = normalized((e1 * v2 - e2 * v1) / det), against_v = normalized((e1 * u2 - e2 * u1) / det);
    for (const std::uint32_t v : t) {
      const Vec3d n = to_double(mesh.normal[v]), x{mesh.tangent[v].x, mesh.tangent[v].y, mesh.tangent[v].z};
      EXPECT_NEAR(length(n), 1, 1e-6);
      EXPECT_NEAR(length(x), 1, 1e-6);
      EXPECT_NEAR(dot(n, x), 0, 1e-6);
      EXPECT_EQ(mesh.tangent[v].w, 1);
      EXPECT_GT(dot(x, along_u), 0.5);  // charts are not steeper than 60 degrees
      EXPECT_GT(dot(cross(n, x), against_v), 0.5);
    }
  }
}

TEST(DeliveredMesh, KeepsTheEdgesOfACubeSharp) {
  const Surface s = surface_of(testing::cube(2));
  const Atlas atlas = placed(s.position, s.triangles, 256);
  const Mesh mesh = delivered_mesh(s, &atlas, false);
  for (const Vec3f& n : mesh.normal)
    EXPECT_NEAR(std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)}), 1, 1e-6);  // of one side alone
}

/// Texels that all hold this normal and colour.
std::vector<Texel> even_texels(const Atlas& atlas, const Vec3f& normal, const Vec3f& color) {
  return std::vector<Texel>(static_cast<std::size_t>(atlas.side) * static_cast<std::size_t>(atlas.side),
                            Texel{normal * 2.0F, color * 2.0F, 2});
}

TEST(Maps, ShowTheNormalsThatFellIntoThem) {
  const Surface s = surface_of(testing::sheet(3, 3, [](double u, double v) { return Vec3d{u, v, 0}; }));
  const Atlas atlas = placed(s.position, s.triangles, 64);
  const Mesh mesh = delivered_mesh(s, &atlas, true);
  const Vec3f tilted = normalized(Vec3f{0.3F, -0.2F, 1});
  Threads threads(2);
  const SurfaceMaps maps = make_maps(mesh, atlas, even_texels(atlas, tilted, {0.5F, 0.25F, 1}), true, 8, threads);
  EXPECT_EQ(maps.filled, 0);
  std::vector<NormalProbe> probes;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) probes.push_back({t, 0.3F, 0.3F, tilted, 1});
  EXPECT_LT(normal_error(mesh, &maps, probes), 0.4);  // 8 bits: half a step of 1/127.5 in each of three numbers
  EXPECT_GT(normal_error(mesh, nullptr, probes), 15);
  const SurfaceMaps deep = make_maps(mesh, atlas, even_texels(atlas, tilted, {0.5F, 0.25F, 1}), true, 16, threads);
  EXPECT_EQ(deep.normal.size(), 2 * maps.normal.size());
  EXPECT_EQ(deep.color, maps.color);
  // Half a step of 1/32767.5 is .002 degrees; the arc cosine of a float next to 1 is .02.
  EXPECT_LT(normal_error(mesh, &deep, probes), 0.02);
  const Chart& chart = atlas.charts[0];
  const std::size_t middle = 3 * (static_cast<std::size_t>(chart.y + chart.height / 2) * 64 +
                                  static_cast<std::size_t>(chart.x + chart.width / 2));
  EXPECT_EQ(maps.color[middle], 188);  // .5, .25 and 1 in sRGB
  EXPECT_EQ(maps.color[middle + 1], 137);
  EXPECT_EQ(maps.color[middle + 2], 255);
}

TEST(Maps, FillHolesFromWhatIsAround) {
  const Surface s = surface_of(testing::sheet(3, 3, [](double u, double v) { return Vec3d{u, v, 0}; }));
  const Atlas atlas = placed(s.position, s.triangles, 64);
  const Mesh mesh = delivered_mesh(s, &atlas, true);
  const Vec3f left = normalized(Vec3f{-1, 0, 1}), right = normalized(Vec3f{1, 0, 1});
  auto texels = even_texels(atlas, left, {0, 0, 0});
  const Chart& chart = atlas.charts[0];
  const bool lying = std::abs(chart.tangent.x) > 0.5;
  ASSERT_TRUE(lying || std::abs(chart.tangent.y) > 0.5);
  for (std::size_t y = 0; y < 64; ++y) {
    for (std::size_t x = 0; x < 64; ++x) {
      if (x >= 16 && x < 48) texels[64 * y + x] = {};
      if (x >= 48) texels[64 * y + x] = {right, {1, 1, 1}, 1};
    }
  }
  Threads threads(1);
  const SurfaceMaps maps = make_maps(mesh, atlas, texels, true, 8, threads);
  EXPECT_GT(maps.filled, 0.3);
  int before = -1;
  for (std::size_t x = static_cast<std::size_t>(chart.x + 4); x < 60; ++x) {
    const int grey = maps.color[3 * (32 * 64 + x)];
    EXPECT_GE(grey, before - 8);  // rises from black to white; blocks of the pyramid are smoothed, not gone
    before = std::max(before, grey);
  }
  EXPECT_EQ(before, 255);
}

TEST(Maps, OfAChartThatNothingFellIntoAreFlat) {
  const Surface s = surface_of(testing::sheet(1, 1, [](double u, double v) { return Vec3d{u, v, 0}; }));
  const Atlas atlas = placed(s.position, s.triangles, 64);
  const Mesh mesh = delivered_mesh(s, &atlas, true);
  Threads threads(1);
  const SurfaceMaps maps = make_maps(mesh, atlas, std::vector<Texel>(64 * 64), true, 8, threads);
  for (std::size_t i = 0; i < maps.normal.size(); i += 3) {
    EXPECT_EQ(maps.normal[i], 128);
    EXPECT_EQ(maps.normal[i + 2], 255);
  }
  const SurfaceMaps deep = make_maps(mesh, atlas, std::vector<Texel>(64 * 64), true, 16, threads);
  for (std::size_t i = 0; i < deep.normal.size(); i += 6) {
    EXPECT_EQ(256 * deep.normal[i] + deep.normal[i + 1], 32768);
    EXPECT_EQ(256 * deep.normal[i + 4] + deep.normal[i + 5], 65535);
  }
}

}  // namespace
}  // namespace kiln
