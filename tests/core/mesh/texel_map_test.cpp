#include "core/mesh/texel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/mesh/texel_seams.h"

namespace kiln {
namespace {

/// A rectangle of the plane y = 0 from (x, z) to (x + w, z + h), two triangles, with coordinates of its own.
struct Sheet {
  float x, z, w, h;
  std::array<Vec2f, 4> uv;  // of (x, z), (x + w, z), (x + w, z + h), (x, z + h)
};

Mesh mesh_of(const std::vector<Sheet>& sheets) {
  Mesh mesh;
  for (const Sheet& s : sheets) {
    const auto first = static_cast<std::uint32_t>(mesh.position.size());
    for (const Vec3f& p : {Vec3f{s.x, 0, s.z}, {s.x + s.w, 0, s.z}, {s.x + s.w, 0, s.z + s.h}, {s.x, 0, s.z + s.h}})
      mesh.position.push_back(p), mesh.normal.push_back({0, 1, 0});
    mesh.uv1.insert(mesh.uv1.end(), s.uv.begin(), s.uv.end());
    mesh.triangles.push_back({first, first + 2, first + 1});
    mesh.triangles.push_back({first, first + 3, first + 2});
    mesh.part.insert(mesh.part.end(), 2, 0);
  }
  return mesh;
}

std::array<Vec2f, 4> box(float u, float v, float w, float h) {
  return {Vec2f{u, v}, {u + w, v}, {u + w, v + h}, {u, v + h}};
}

UvCharts charts_of(const Mesh& mesh) { return find_uv_charts(mesh, std::vector<char>(mesh.triangles.size(), 1)); }

Vec3f place(const Mesh& mesh, const TexelPlace& at) {
  const Triangle& t = mesh.triangles[at.triangle];
  return mesh.position[t[0]] * (1 - at.u - at.v) + mesh.position[t[1]] * at.u + mesh.position[t[2]] * at.v;
}

/// Texels of a light that is linear in position.
const Vec3f kSlope{3, 0, 5};
float light_at(const Vec3f& p) { return 10 + dot(kSlope, p); }

std::vector<Vec3f> lit(const Mesh& mesh, const TexelMap& map, const UvCharts& charts) {
  std::vector<Vec3f> texels(static_cast<std::size_t>(map.side) * static_cast<std::size_t>(map.side));
  std::vector<char> known(texels.size(), 0);
  for (const TexelPlace& at : map.places) {
    const float x = light_at(place(mesh, at));
    texels[at.texel] = {x, x, x};
    known[at.texel] = 1;
  }
  fill_texels(map, charts, known, texels);
  return texels;
}

float filtered(const std::vector<Vec3f>& texels, const Vec2f& uv, int side) {
  const Bilinear b = bilinear_at(uv, side);
  float sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += texels[b.texel[k]].x * b.weight[k];
  return sum;
}

TEST(TexelMap, CentresStandWhereTheirCoordinatesAre) {
  const Mesh mesh = mesh_of({{0, 0, 1, 1, box(0, 0, 1, 1)}});
  const TexelMap map = map_texels(mesh, charts_of(mesh), 8);
  ASSERT_EQ(map.places.size(), 64U);
  EXPECT_EQ(map.inside, 64U);
  EXPECT_EQ(map.within + map.across, 0U);
  for (const TexelPlace& at : map.places) {
    const Vec3f p = place(mesh, at);
    EXPECT_NEAR(p.x, (static_cast<float>(at.texel % 8) + 0.5F) / 8, 1e-6F);
    EXPECT_NEAR(p.z, (static_cast<float>(at.texel / 8) + 0.5F) / 8, 1e-6F);
  }
}

TEST(TexelMap, BilinearFilteringOfALinearLightIsExactBetweenCentres) {
  const Mesh mesh = mesh_of({{0, 0, 1, 1, box(0, 0, 1, 1)}});
  const UvCharts charts = charts_of(mesh);
  const std::vector<Vec3f> texels = lit(mesh, map_texels(mesh, charts, 16), charts);
  for (const Vec2f uv : {Vec2f{0.5F, 0.5F}, {0.04F, 0.9F}, {0.33F, 0.71F}})
    EXPECT_NEAR(filtered(texels, uv, 16), light_at({uv.x, 0, uv.y}), 2e-5F);  // floats near 18
}

TEST(TexelMap, TellsChartsThatLieOnOneAnotherFromThoseThatFold) {
  const auto half = box(0, 0, 0.5F, 1);
  const Mesh two = mesh_of({{0, 0, 1, 1, half}, {3, 0, 1, 1, half}});
  const TexelMap across = map_texels(two, charts_of(two), 32);
  EXPECT_EQ(charts_of(two).count, 2U);
  EXPECT_NEAR(double(across.across), 32 * 16, 2 * 32);  // but for the diagonals of both, which lie on centres
  EXPECT_EQ(across.within, 0U);
  // The second triangle of a sheet folded back onto the first.
  const Mesh folded = mesh_of({{0, 0, 1, 1, {Vec2f{0, 0}, {1, 0}, {1, 1}, {0.9F, 0.1F}}}});
  const TexelMap within = map_texels(folded, charts_of(folded), 32);
  EXPECT_GT(within.within, 300U);
  EXPECT_EQ(within.across, 0U);
}

TEST(TexelMap, OfTrianglesWithoutAreaInThePictureIsALineOrADot) {
  const Mesh line = mesh_of({{0, 0, 1, 1, {Vec2f{0.2F, 0.5F}, {0.8F, 0.5F}, {0.8F, 0.5F}, {0.2F, 0.5F}}}});
  EXPECT_GT(map_texels(line, charts_of(line), 16).places.size(), 8U);
  const Mesh dot = mesh_of({{0, 0, 1, 1, box(0.5F, 0.5F, 0, 0)}});
  EXPECT_GE(map_texels(dot, charts_of(dot), 16).places.size(), 1U);
  const Mesh far = mesh_of({{0, 0, 1, 1, box(1e30F, -1e30F, 1e30F, 1e30F)}});
  EXPECT_TRUE(map_texels(far, charts_of(far), 16).places.empty());
}

TEST(PackedCharts, LieBesideEachOtherAtOneDensityWithTheirBordersOnCentres) {
  // Two instances of one layout, one of them twice as large, a layout that tiles, and a dot.
  const Mesh mesh = mesh_of({{0, 0, 1, 1, box(0, 0, 1, 1)},
                             {2, 0, 2, 2, box(0, 0, 1, 1)},
                             {5, 0, 1, 1, box(-7, 3, 2, 2)},
                             {7, 0, 1, 1, box(0.5F, 0.5F, 0, 0)}});
  const UvCharts charts = charts_of(mesh);
  constexpr int kSide = 64;
  const auto packed = pack_uv_charts(mesh, charts, kSide);
  ASSERT_TRUE(packed);
  Mesh after = mesh;
  after.uv1 = *packed;
  const TexelMap map = map_texels(after, charts, kSide);
  EXPECT_EQ(map.across + map.within, 0U);
  const auto texels = [&](std::size_t a, std::size_t b) {
    return kSide * length((*packed)[4 * a + b] - (*packed)[4 * a]);
  };
  EXPECT_GT(texels(0, 1), 15);  // of the 64, with 1 + 2 units side by side
  for (const std::size_t corner : {1U, 3U}) {
    EXPECT_NEAR(texels(1, corner) / texels(0, corner), 2, 1.5 / texels(0, corner));  // whole texels
    EXPECT_NEAR(texels(2, corner), texels(0, corner), 1e-3);
  }
  for (std::size_t v = 0; v < 16; ++v) {
    const float x = kSide * (*packed)[v].x - 0.5F;
    EXPECT_NEAR(x, std::round(x), 1e-3F);
  }
  // A border on centres needs nothing from outside: the light is exact up to the very edge.
  const std::vector<Vec3f> light = lit(after, map, charts);
  for (std::size_t v = 0; v < 12; ++v)
    EXPECT_NEAR(filtered(light, after.uv1[v], kSide), light_at(after.position[v]), 1e-3F);
}

TEST(PackedCharts, ThatAreTooManyForThePictureAreNotPlaced) {
  std::vector<Sheet> many;
  for (int i = 0; i < 100; ++i) many.push_back({static_cast<float>(2 * i), 0, 1, 1, box(0, 0, 1, 1)});
  const Mesh mesh = mesh_of(many);
  EXPECT_FALSE(pack_uv_charts(mesh, charts_of(mesh), 16));  // 25 rectangles of 3 x 3 texels at most
  EXPECT_TRUE(pack_uv_charts(mesh, charts_of(mesh), 64));
}

/// Two sheets that meet along x = 1; the second lies turned by 33 degrees in the picture, so that its border crosses
/// texels anywhere.
Mesh seamed() {
  const float c = 0.35F * std::cos(0.58F), s = 0.35F * std::sin(0.58F);
  const Vec2f at{0.75F, 0.1F}, along{c, s}, down{-s, c};
  return mesh_of(
      {{0, 0, 1, 1, box(0.03F, 0.04F, 0.37F, 0.36F)}, {1, 0, 1, 1, {at, at + along, at + along + down, at + down}}});
}

double largest_gap(const std::vector<SeamPlace>& seams, const std::vector<Vec3f>& texels, int side) {
  double most = 0;
  for (const SeamPlace& s : seams)
    most = std::max(most, std::abs(double{filtered(texels, s.here, side)} - double{filtered(texels, s.there, side)}));
  return most;
}

TEST(Seams, AgreeToATenthOfWhatATexelOfTheLightsSlopeIs) {
  const Mesh mesh = seamed();
  const UvCharts charts = charts_of(mesh);
  ASSERT_EQ(charts.count, 2U);
  for (const int side : {32, 64, 128}) {
    const TexelMap map = map_texels(mesh, charts, side);
    const std::vector<SeamPlace> seams = find_seams(mesh, charts, side);
    ASSERT_GT(seams.size(), static_cast<std::size_t>(side) / 2);
    std::vector<Vec3f> texels = lit(mesh, map, charts);
    const double of_a_texel = length(kSlope) / (0.35 * side), before = largest_gap(seams, texels, side);
    stitch_seams(seams, map, texels);
    const double after = largest_gap(seams, texels, side);
    std::printf("side %d: a texel %.4f, before %.4f, after %.4f\n", side, of_a_texel, before, after);
    EXPECT_GT(before, 0.1 * of_a_texel);  // there is something to mend
    EXPECT_LT(before, of_a_texel);
    EXPECT_LT(after, 0.1 * of_a_texel);
    // And what it costs inside: no place is moved by more than the gap was.
    for (const TexelPlace& at : map.places) {
      if (!at.inside) continue;
      EXPECT_NEAR(texels[at.texel].x, light_at(place(mesh, at)), before);
    }
  }
}

TEST(Seams, AreNoneWhereNormalsDifferOrCoordinatesAgree) {
  Mesh creased = seamed();
  for (std::size_t v = 4; v < 8; ++v) creased.normal[v] = {1, 0, 0};
  EXPECT_TRUE(find_seams(creased, charts_of(creased), 64).empty());
  const Mesh whole = mesh_of({{0, 0, 1, 1, box(0, 0, 0.5F, 1)}, {1, 0, 1, 1, box(0.5F, 0, 0.5F, 1)}});
  EXPECT_EQ(charts_of(whole).count, 1U);
  EXPECT_TRUE(find_seams(whole, charts_of(whole), 64).empty());
}

TEST(FilledTexels, TakeTheLightOfTheirOwnChartFirst) {
  const Mesh mesh = mesh_of({{0, 0, 1, 1, box(0, 0, 0.5F, 1)}, {9, 0, 1, 1, box(0.5F, 0, 0.5F, 1)}});
  const UvCharts charts = charts_of(mesh);
  const TexelMap map = map_texels(mesh, charts, 16);
  std::vector<Vec3f> texels(256, {1, 1, 1});
  std::vector<char> known(256, 1);
  for (std::size_t i = 0; i < 256; ++i) {
    if (i % 16 >= 8) texels[i] = {7, 7, 7};
    if (i % 16 >= 4 && i % 16 < 8) known[i] = 0;  // between them, of the first chart
  }
  fill_texels(map, charts, known, texels);
  for (std::size_t i = 0; i < 256; ++i) EXPECT_EQ(texels[i].x, i % 16 < 8 ? 1 : 7);
  std::vector<Vec3f> none(256);
  fill_texels(map, charts, std::vector<char>(256, 0), none);
  EXPECT_EQ(none[100], (Vec3f{}));
}

}  // namespace
}  // namespace kiln
