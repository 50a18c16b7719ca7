#include "core/prt/interreflection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/prt/hit_albedo.h"
#include "core/prt/packed_rows.h"
#include "core/prt/row_sum.h"
#include "core/trace/surface.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// A closed box with walls of one albedo, whose vertices are all lit alike by lamps.
Scene closed_box(float albedo, bool double_sided = false) {
  Scene scene = testing::empty_scene();
  const std::uint32_t part = testing::add_part(scene, {albedo, albedo, albedo}, double_sided);
  testing::add_box(scene, {-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}, 3, true, part);
  return scene;
}

Transfer furnace(const Scene& scene, int bounces) {
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const std::size_t count = scene.mesh.position.size();
  return bake_interreflection(tracer, scene.mesh, std::vector<float>(count, 0.0F), std::vector<Vec3f>(count, {1, 1, 1}),
                              {.order = 1, .bounces = bounces, .samples = 64}, threads);
}

TEST(Interreflection, WhiteFurnaceSumsTheGeometricSeries) {
  for (const float rho : {0.0F, 0.5F, 0.9F, 0.99F}) {
    const Scene scene = closed_box(rho);
    for (const int bounces : {0, 1, 2, 20}) {
      const Transfer t = furnace(scene, bounces);
      ASSERT_TRUE(t.fixed);
      const float expected = (1 - std::pow(rho, static_cast<float>(bounces + 1))) / (1 - rho);
      for (std::size_t v = 0; v < t.vertices(); ++v) {
        // Every ray ends on a wall lit alike; the tracer lets 1e-3 of the rays at seams through, at each bounce.
        EXPECT_NEAR(t.at(v, 0)[1] / expected, 1, 1e-5 + 0.02 * rho * std::min(bounces, 3)) << rho << ' ' << bounces;
      }
    }
  }
}

TEST(Interreflection, WhiteFurnaceTendsToOneOverOneMinusAlbedo) {
  const Transfer t = furnace(closed_box(0.5F), 24);
  double sum = 0;
  for (std::size_t v = 0; v < t.vertices(); ++v) sum += t.at(v, 0)[1];
  EXPECT_NEAR(sum / static_cast<double>(t.vertices()), 2, 0.004);  // 2^-24, and seams: see above
}

// A hundredth-sized box in the middle of the room: 96 vertices of next to no surface beside the walls' 96.
TEST(Interreflection, VerticesOfLittleSurfaceTakeAQuarterOfTheRays) {
  Scene scene = closed_box(0.5F);
  testing::add_box(scene, {-0.01F, -0.01F, -0.01F}, {0.01F, 0.01F, 0.01F}, 3, false, 0);
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const std::size_t count = scene.mesh.position.size();
  ASSERT_EQ(count, 192U);
  TransferStats stats;
  const Transfer t =
      bake_interreflection(tracer, scene.mesh, std::vector<float>(count, 0.0F), std::vector<Vec3f>(count, {1, 1, 1}),
                           {.order = 1, .bounces = 1, .samples = 256}, threads, &stats);
  EXPECT_EQ(stats.rays, 96U * 256 + 96U * 64);
  for (std::size_t v = 0; v < count; ++v) EXPECT_NEAR(t.at(v, 0)[1], 1.5, 0.03) << v;  // 1 + rho, seams as above
}

TEST(Interreflection, NoBouncesOnlyJoinsDirectLight) {
  const Scene scene = closed_box(0.5F);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  std::vector<float> direct(scene.mesh.position.size() * 4);
  std::vector<Vec3f> fixed;
  for (std::size_t i = 0; i < direct.size(); ++i) direct[i] = 0.001F * static_cast<float>(i % 200);
  for (std::size_t v = 0; v < scene.mesh.position.size(); ++v) fixed.push_back({static_cast<float>(v), 2, 3});
  const Transfer t = bake_interreflection(tracer, scene.mesh, direct, fixed, {.order = 2, .bounces = 0}, threads);
  EXPECT_EQ(t.channels, 3);
  EXPECT_EQ(t.slots(), 5);
  for (std::size_t v = 0; v < t.vertices(); ++v) {
    for (int c = 0; c < 3; ++c) {
      // Rounding to 16 bits: 5e-6 in band 0 and 1e-5 in band 1 (packed_rows.h).
      for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(t.at(v, c)[i], direct[4 * v + i], 1.1e-5);
      EXPECT_EQ(t.at(v, c)[4], fixed[v][static_cast<std::size_t>(c)]);
    }
  }
}

TEST(Interreflection, GreyScenesKeepOneChannel) {
  const Scene grey = closed_box(0.5F);
  EXPECT_EQ(furnace(grey, 1).channels, 1);
  Scene red = closed_box(0.5F);
  red.materials[1].base_color = {0.5F, 0.1F, 0.1F, 1};
  EXPECT_EQ(furnace(red, 1).channels, 3);
  EXPECT_EQ(furnace(red, 0).channels, 1);
}

TEST(Interreflection, ColourBleedsChannelByChannel) {
  Scene scene = closed_box(0.5F);
  scene.materials[1].base_color = {0.8F, 0.4F, 0.2F, 1};
  const Transfer t = furnace(scene, 3);
  for (int c = 0; c < 3; ++c) {
    const double rho = std::array{0.8, 0.4, 0.2}[static_cast<std::size_t>(c)];
    double sum = 0;
    for (std::size_t v = 0; v < t.vertices(); ++v) sum += t.at(v, c)[1];
    EXPECT_NEAR(sum / static_cast<double>(t.vertices()), 1 + rho + rho * rho + rho * rho * rho, 0.01);  // seams
  }
}

// A floor of albedo 0 and a wall of albedo rho that is lit by T = 1: the floor's point sees rho times its form factor.
TEST(Interreflection, PointBesideALitWallSeesItsFormFactor) {
  constexpr float kRho = 0.6F;
  for (const bool textured : {false, true}) {  // vertex colours take the weighted path
    Scene scene = testing::empty_scene();
    const std::uint32_t black = testing::add_part(scene, {0, 0, 0});
    const std::uint32_t lit = testing::add_part(scene, {kRho, kRho, kRho});
    testing::add_grid(scene, {-0.25F, 0, 0.25F}, {0.5F, 0, 0}, {0, 0, -0.5F}, 2, 2, black);
    const std::size_t floor_vertices = scene.mesh.position.size();
    testing::add_grid(scene, {-0.25F, 0.25F, -0.25F}, {0.5F, 0, 0}, {0, 0, 0.5F}, 4, 4, lit);  // overhead, facing down
    scene.parts[lit].has_color = textured;
    if (textured) scene.mesh.color.assign(scene.mesh.position.size(), {1, 1, 1, 1});
    Threads threads(1);
    const Tracer tracer(scene, threads);
    std::vector<float> direct(scene.mesh.position.size(), 0.0F);
    for (std::size_t v = floor_vertices; v < direct.size(); ++v) direct[v] = 0.25F;
    const Interreflection params{.order = 1, .bounces = 1, .samples = 4096};
    const Transfer t = bake_interreflection(tracer, scene.mesh, direct, {}, params, threads);
    // Element under the centre of a square of half side 0.25 at height 0.25: four corner factors at 1, 1.
    const float corner = 2 / std::numbers::sqrt2_v<float> * std::atan(1 / std::numbers::sqrt2_v<float>) / (2 * kPi);
    EXPECT_NEAR(t.at(4, 0)[0], 0.25F * kRho * 4 * corner, 3e-4);  // 4096 stratified rays: 1e-3 of 0.15
  }
}

TEST(Interreflection, BackOfASingleSidedFaceIsBlackAndOfADoubleSidedOneReflects) {
  for (const bool double_sided : {false, true}) {
    Scene scene = testing::empty_scene();
    const std::uint32_t black = testing::add_part(scene, {0, 0, 0});
    const std::uint32_t sheet = testing::add_part(scene, {0.5F, 0.5F, 0.5F}, double_sided);
    testing::add_grid(scene, {-0.25F, 0, 0.25F}, {0.5F, 0, 0}, {0, 0, -0.5F}, 2, 2, black);
    testing::add_grid(scene, {-0.25F, 0.25F, 0.25F}, {0.5F, 0, 0}, {0, 0, -0.5F}, 1, 1, sheet);  // faces up
    Threads threads(1);
    const Tracer tracer(scene, threads);
    const std::vector<float> none(scene.mesh.position.size(), 0.0F);
    const Transfer t =
        bake_interreflection(tracer, scene.mesh, none, {}, {.order = 1, .bounces = 1, .samples = 4096}, threads);
    if (!double_sided) {
      EXPECT_EQ(t.at(4, 0)[0], 0.0F);
      continue;
    }
    // The sheet's underside is lit by the sky around the floor, which covers form factor F of it: under a sky of 1 it
    // leaves 0.5 (1 - F(y)) at each point y, seen under form factor F(centre). Mean over two facing unit squares at
    // half their side: between both extremes.
    const float value = t.at(4, 0)[0] / 0.28209479F;
    EXPECT_GT(value, 0.5F * 0.5541F * (1 - 0.5541F));
    EXPECT_LT(value, 0.5F * 0.5541F * (1 - 0.2F));
  }
}

TEST(Interreflection, TheSameBitsForAnyThreadCount) {
  const Scene scene = testing::room_scene();
  Threads one(1), two(2);
  const Tracer tracer(scene, one);
  const std::vector<float> direct(scene.mesh.position.size() * 9, 0.05F);
  const Interreflection params{.order = 3, .bounces = 2, .samples = 64};
  EXPECT_EQ(bake_interreflection(tracer, scene.mesh, direct, {}, params, one).coefficients,
            bake_interreflection(tracer, scene.mesh, direct, {}, params, two).coefficients);
}

TEST(HitAlbedo, TheMeanOfManyTapsIsTheFilteredTexture) {
  Scene scene = testing::empty_scene();
  const std::uint32_t part = testing::add_part(scene, {0.9F, 0.8F, 0.7F});
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1, part);
  Image image{.width = 3, .height = 2, .rgba = {}};
  for (int i = 0; i < 24; ++i) image.rgba.push_back(static_cast<std::uint8_t>(37 * i % 251));
  scene.images.push_back(image);
  scene.mesh.uv0 = {{-0.7F, 0.1F}, {1.9F, 0.2F}, {-0.3F, 2.3F}, {1.6F, 1.1F}};
  Random random(9, 9);
  for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
    scene.textures = {{.image = 0, .wrap_u = wrap, .wrap_v = wrap}};
    scene.materials[1].base_color_texture = {.texture = 0, .transform = {1, 0, 0.25F, 0, 1, -0.5F}};
    const HitAlbedo taps(scene);
    for (int point = 0; point < 20; ++point) {
      const float u = random.uniform(), v = (1 - u) * random.uniform();
      Vec3f mean;
      constexpr int kDraws = 4000;
      for (int i = 0; i < kDraws; ++i) {
        mean += taps.read(taps.tap(1, u, v, static_cast<std::uint32_t>(random.next()))) / kDraws;
      }
      const Vec3f exact = albedo_at(scene, surface_point(scene, 1, u, v));
      // Texels differ by 0.9 at most: four standard errors of 4000 draws of a coin are 0.03.
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], exact[c], 0.03);
    }
  }
}

TEST(HitAlbedo, AFineTextureKeepsItsMeanInLinearLight) {
  Scene scene = testing::empty_scene();
  const std::uint32_t part = testing::add_part(scene, {1, 1, 1});
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1, part);
  scene.mesh.uv0 = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  Image image{.width = 512, .height = 256, .rgba = {}};
  for (int i = 0; i < 512 * 256; ++i) {  // black and white columns
    const auto c = static_cast<std::uint8_t>(i % 2 == 0 ? 0 : 255);
    image.rgba.insert(image.rgba.end(), {c, c, c, 255});
  }
  scene.images.push_back(image);
  scene.textures = {{.image = 0}};
  scene.materials[1].base_color_texture = {.texture = 0};
  const HitAlbedo taps(scene);
  // One step of 8-bit sRGB at a half is 0.009.
  EXPECT_NEAR(taps.read(taps.tap(0, 0.3F, 0.3F, 12345U)).x, 0.5F, 0.005F);
}

TEST(PackedRows, RoundWithinTheStatedError) {
  std::vector<std::int16_t> memory(5000 * 112);
  PackedRows rows(6, 3, memory.data(), PackedRows::row_bytes(6, 3));
  std::array<float, 108> in, out;
  Random random(1, 2);
  for (const std::size_t r : {0U, 4095U, 4096U, 4999U}) {
    for (float& x : in) x = random.uniform() - 0.5F;
    in[0] = 0.28F;
    rows.store(r, in.data());
    rows.load(r, out.data());
    for (std::size_t i = 0; i < 108; ++i) {
      const bool clamped = std::abs(in[i]) > 32767 * rows.unit(static_cast<int>(i));
      if (!clamped) {
        EXPECT_NEAR(out[i], in[i], 0.51F * rows.unit(static_cast<int>(i)));
      }
    }
  }
}

TEST(RowSum, ShortAndWeightedRowsAddAsInScalarCode) {
  for (const int width : {8, 40, 112, 304}) {
    std::vector<std::int16_t> a(static_cast<std::size_t>(width)), b(a);
    std::vector<std::int32_t> sum(a.size(), 7);
    std::vector<float> weight(a.size()), weighted(a.size(), 1);
    Random random(3, static_cast<std::uint64_t>(width));
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = static_cast<std::int16_t>(random.next());
      b[i] = static_cast<std::int16_t>(random.next());
      weight[i] = random.uniform();
    }
    const std::array<const std::int16_t*, 2> rows = {a.data(), b.data()};
    add_short_rows(rows, width, sum.data());
    add_weighted_row(a.data(), weight.data(), width, weighted.data());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(sum[i], 7 + a[i] + b[i]);
      EXPECT_EQ(weighted[i], 1 + weight[i] * static_cast<float>(a[i]));
    }
  }
}

}  // namespace
}  // namespace kiln
