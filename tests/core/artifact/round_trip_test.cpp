// What write_baked_glb writes, read_baked_glb reads back within the errors that core/artifact/README.md states.

#include "tests/core/artifact/round_trip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "core/artifact/baked_geometry.h"
#include "core/artifact/evaluate.h"
#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/sample_scene.h"

namespace kiln {
namespace {

/// Half a quantisation step. Float arithmetic may slip past the middle between two levels by one rounding of 2^-23 for
/// each level.
double half_step(double range, int bits) {
  const double levels = std::exp2(bits) - 1;
  return range / levels / 2 * (1 + 2 * levels * 0x1p-23);
}

/// The bound of one slot: half a step, and the rounding of offset + scale * stored to float (2^-149 if denormal).
double slot_bound(const StoredForm& ranges, std::size_t s, int bits) {
  return half_step(2 * ranges.scale[s], bits) + (std::abs(ranges.offset[s]) + ranges.scale[s]) * 0x1p-23 + 0x1p-149;
}

/// The largest error of any slot in units of its bound.
double worst_slot_error(const BakedScene& written, const BakedScene& read, int bits) {
  const StoredTransfer stored(written.transfer, {.bits = bits}, used_vertices(written.scene.mesh));
  const StoredForm& ranges = stored.form();
  const auto original = original_vertices(read);
  double worst = 0;
  for (std::size_t v = 0; v < original.size(); ++v) {
    const float* a = written.transfer.at(original[v], 0);
    const float* b = read.transfer.at(v, 0);
    for (std::size_t s = 0; s < written.transfer.stride(); ++s) {
      worst = std::max(worst, std::abs(static_cast<double>(a[s]) - b[s]) / slot_bound(ranges, s, bits));
    }
  }
  return worst;
}

TEST(BakedScene, EverySlotComesBackWithinHalfAQuantisationStep) {
  for (int order = 1; order <= kMaxShOrder; ++order) {
    for (const int channels : {1, 3}) {
      for (const bool fixed : {false, true}) {
        const BakedScene written = random_baked({.order = order, .channels = channels, .fixed = fixed, .side = 5});
        const BakedScene read = round_trip(written);
        EXPECT_EQ(read.transfer.order, order);
        EXPECT_EQ(read.transfer.channels, channels);
        EXPECT_EQ(read.transfer.fixed, fixed);
        EXPECT_EQ(read.transfer.vertices(), written.transfer.vertices());
        EXPECT_LE(worst_slot_error(written, read, 12), 1) << "order " << order << " channels " << channels;
      }
    }
  }
}

TEST(BakedScene, LightThatCannotBeTurnedComesBackAsWell) {
  BakedScene written = random_baked({.order = 0, .channels = 3, .fixed = true, .side = 5});
  written.light.coefficients.clear();
  const BakedScene read = round_trip(written);
  EXPECT_EQ(read.transfer.order, 0);
  EXPECT_EQ(read.transfer.slots(), 1);
  EXPECT_TRUE(read.transfer.fixed);
  EXPECT_LE(worst_slot_error(written, read, 12), 1);
  const auto original = original_vertices(read);
  const Vec3f light = value_at(read.transfer, 7, {});  // what `kiln eval` shows
  EXPECT_NEAR(light.y, written.transfer.at(original[7], 1)[0], 1e-3F);
}

TEST(BakedScene, TheBoundIsTight) {
  // Random values meet the middle between levels: a bound twice as large as needed would show here.
  const BakedScene written = random_baked({.order = 4});
  EXPECT_GT(worst_slot_error(written, round_trip(written), 12), 0.9);
}

TEST(BakedScene, HugeAndTinyRangesKeepTheirRelativePrecision) {
  for (const double magnitude : {1e-38, 1e-12, 1e-3, 1e12, 1e36}) {
    const BakedScene written = random_baked({.order = 3, .fixed = true, .magnitude = magnitude});
    EXPECT_LE(worst_slot_error(written, round_trip(written), 12), 1) << magnitude;
  }
}

TEST(BakedScene, TinyVariationOnALargeConstantSurvives) {
  BakedScene written = random_baked({.order = 2, .channels = 1});
  for (std::size_t v = 0; v < written.transfer.vertices(); ++v) {
    written.transfer.coefficients[v * 4 + 1] = 1e6F + static_cast<float>(v % 8) * 0.0625F;  // one ulp at 1e6
  }
  EXPECT_LE(worst_slot_error(written, round_trip(written), 12), 1);
}

TEST(BakedScene, AConstantSlotIsExact) {
  for (const float constant : {0.0F, 1.0F, -0.1F, 1e-30F, 1e30F}) {
    BakedScene written = random_baked({.order = 1, .channels = 1, .fixed = true});
    for (std::size_t v = 0; v < written.transfer.vertices(); ++v) written.transfer.coefficients[2 * v + 1] = constant;
    const BakedScene read = round_trip(written);
    for (std::size_t v = 0; v < read.transfer.vertices(); ++v) {
      ASSERT_EQ(read.transfer.coefficients[2 * v + 1], constant);
    }
  }
}

TEST(BakedScene, MoreBitsMeanLessError) {
  const BakedScene written = random_baked({.order = 2});
  for (const int bits : {11, 14, 16, 20}) {
    EXPECT_LE(worst_slot_error(written, round_trip(written, {.transfer = {.bits = bits}}), bits), 1) << bits;
  }
}

TEST(BakedScene, TheSameSceneGivesTheSameBytes) {
  const RandomBaked params{.order = 4, .fixed = true};
  EXPECT_EQ(*write_baked_glb(random_baked(params)), *write_baked_glb(random_baked(params)));
}

TEST(BakedScene, GeometryComesBackWithinTheStatedGrids) {
  const BakedScene written = random_baked({.order = 1, .channels = 1});
  const BakedScene read = round_trip(written);
  const Mesh &a = written.scene.mesh, &b = read.scene.mesh;
  const auto original = original_vertices(read);
  // Octahedral plane: half a step of 2 / (2^12 - 2) in each axis, stretched at most 3 times on the way to the sphere.
  const double normal_bound = 3 * std::sqrt(2.0) / (std::exp2(12) - 2);
  for (std::size_t v = 0; v < original.size(); ++v) {
    const auto w = original[v];
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_LE(std::abs(a.position[w][c] - b.position[v][c]), half_step(1, 16));
    }
    ASSERT_LE(length(a.normal[w] - b.normal[v]), normal_bound);
  }
}

TEST(BakedScene, AttributesOfEachPartComeBack) {
  const BakedScene written = random_baked({.order = 1, .channels = 1});
  const BakedScene read = round_trip(written);
  const Mesh &a = written.scene.mesh, &b = read.scene.mesh;
  const auto original = original_vertices(read);
  const double uv_bound = 0x1p-15 * 1.01 + 140 * 0x1p-23;  // the step is at most 2^-14 however far uv reaches
  for (std::size_t t = 0; t < b.triangles.size(); ++t) {
    const Part& part = read.scene.parts[b.part[t]];
    for (const auto v : b.triangles[t]) {
      const auto w = original[v];
      if (part.has_uv0) {
        ASSERT_NEAR(a.uv0[w].x, b.uv0[v].x, uv_bound);
        ASSERT_NEAR(a.uv0[w].y, b.uv0[v].y, uv_bound);
      }
      if (part.has_uv1) {
        ASSERT_NEAR(a.uv1[w].y, b.uv1[v].y, uv_bound);
      }
      if (part.has_color) {
        ASSERT_NEAR(a.color[w].x, b.color[v].x, half_step(1, 10));
        ASSERT_NEAR(a.color[w].w, b.color[v].w, half_step(1, 10));
      }
      if (part.has_tangent) {
        ASSERT_NEAR(a.tangent[w].z, b.tangent[v].z, half_step(2, 12));
        ASSERT_EQ(a.tangent[w].w, b.tangent[v].w);
      }
    }
  }
}

TEST(BakedScene, TextureCoordinatesFarOutsideKeepTheirGrid) {
  BakedScene written = random_baked({.order = 1, .channels = 1});
  for (Vec2f& uv : written.scene.mesh.uv0) uv = {uv.x * 1e5F, uv.y};  // 60e5 to 140e5: at 24 bits a step is about 0.5
  const BakedScene read = round_trip(written);
  const auto original = original_vertices(read);
  for (std::size_t t = 0; t < read.scene.mesh.triangles.size(); ++t) {
    if (!read.scene.parts[read.scene.mesh.part[t]].has_uv0) continue;
    const auto v = read.scene.mesh.triangles[t][0];
    const double rounding = 2 * 140e5 * 0x1p-24;  // of origin + step * level to float
    ASSERT_NEAR(written.scene.mesh.uv0[original[v]].x, read.scene.mesh.uv0[v].x, half_step(80e5, 24) + rounding);
  }
}

TEST(BakedScene, PartsKeepNameMaterialAndAttributes) {
  const BakedScene written = random_baked({.order = 1});
  const BakedScene read = round_trip(written);
  ASSERT_EQ(read.scene.parts.size(), written.scene.parts.size());
  for (std::size_t i = 0; i < read.scene.parts.size(); ++i) {
    const Part &a = written.scene.parts[i], &b = read.scene.parts[i];
    EXPECT_EQ(std::tie(a.name, a.material, a.has_uv0, a.has_uv1, a.has_color, a.has_tangent),
              std::tie(b.name, b.material, b.has_uv0, b.has_uv1, b.has_color, b.has_tangent));
  }
}

TEST(BakedScene, FrameLightExposureAndProvenanceComeBack) {
  BakedScene written = random_baked({.order = 2});
  written.light = {"sky \"A\"", {{1, 2, 3}, {0.1F, -0.2F, 0.3F}, {0, 0, 1e-7F}, {1e9F, 0, -1}}, {}};
  written.light.bright = {{1, 0, 2}, {-0.5F, 0, 0}, {0, 3, 0}, {0, 0, 0.25F}};
  written.exposure = 0.37F;
  const BakedScene read = round_trip(written);
  EXPECT_EQ(read.scene.frame.scale, written.scene.frame.scale);
  EXPECT_EQ(read.scene.frame.center, written.scene.frame.center);
  EXPECT_EQ(read.light.name, written.light.name);
  EXPECT_EQ(read.light.coefficients, written.light.coefficients);
  EXPECT_EQ(read.light.bright, written.light.bright);
  EXPECT_EQ(read.exposure, written.exposure);
  EXPECT_EQ(read.provenance, written.provenance);
}

TEST(BakedScene, BordersOfPartsMeetBitForBit) {
  // 13 x 5 border lines of the grids, three of them shared by two parts: 4 * 13 * 13 vertices in 13 * (4 * 12 + 1)
  // places.
  const BakedScene read = round_trip(random_baked({.order = 1, .channels = 1}));
  std::map<std::tuple<float, float, float>, int> places;
  for (const Vec3f& p : read.scene.mesh.position) ++places[{p.x, p.y, p.z}];
  EXPECT_EQ(read.scene.mesh.position.size(), 4u * 13 * 13);
  EXPECT_EQ(places.size(), 13u * (4 * 12 + 1));
}

TEST(BakedScene, TrianglesKeepTheirCornersAndWinding) {
  const BakedScene written = random_baked({.order = 1, .channels = 1});
  const BakedScene read = round_trip(written);
  const auto original = original_vertices(read);
  const auto canonical = [](Triangle t) {
    std::ranges::rotate(t, std::ranges::min_element(t));
    return t;
  };
  std::vector<Triangle> a, b;
  for (const Triangle& t : written.scene.mesh.triangles) a.push_back(canonical(t));
  for (const Triangle& t : read.scene.mesh.triangles)
    b.push_back(canonical({original[t[0]], original[t[1]], original[t[2]]}));
  std::ranges::sort(a);
  std::ranges::sort(b);
  EXPECT_EQ(a, b);
}

TEST(BakedScene, ALightAlongEachAxisLightsTheSideThatFacesIt) {
  // A wrong sign convention would turn x or y around; 1/pi times the clamped cosine of order 2 is 1/4 + (n.w) / 2 over
  // pi.
  const std::array<Vec3f, 6> axes{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  for (const Vec3f& normal : axes) {
    BakedScene written = single_triangle(2, 1, false);
    for (std::size_t v = 0; v < 3; ++v) clamped_cosine_transfer(2, normal, &written.transfer.coefficients[4 * v]);
    const BakedScene read = round_trip(written);
    for (const Vec3f& from : axes) {
      std::array<float, 4> y{};
      evaluate_sh(2, from, y.data());
      std::vector<Vec3f> light;
      for (const float c : y) light.push_back({c, c, c});
      const float expected = (0.25F + 0.5F * dot(normal, from)) / 3.14159265F;
      EXPECT_NEAR(value_at(read.transfer, 0, light).y, expected, 1e-6F);  // constant slots are exact: float sums only
    }
  }
}

TEST(BakedScene, ASingleTriangleComesBack) {
  const BakedScene read = round_trip(single_triangle(6, 3, true));
  EXPECT_EQ(read.scene.mesh.triangles.size(), 1u);
  EXPECT_EQ(read.transfer.vertices(), 3u);
}

}  // namespace
}  // namespace kiln
