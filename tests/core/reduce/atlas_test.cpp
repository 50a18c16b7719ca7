#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/reduce/charts.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using testing::Model;

Atlas placed(const std::vector<Vec3d>& position, const std::vector<Triangle>& triangles, int side) {
  Atlas atlas = make_charts(position, triangles);
  EXPECT_TRUE(place_charts(atlas, side));
  return atlas;
}

Atlas atlas_of(const Model& model, int side = 512) { return placed(model.position, model.triangles, side); }

/// Each texel centre belongs to at most one triangle of all charts, and to its chart's rectangle without padding.
void expect_no_overlap(const Model& model, const Atlas& atlas) {
  std::vector<int> owner(static_cast<std::size_t>(atlas.side) * static_cast<std::size_t>(atlas.side), -1);
  for (std::uint32_t t = 0; t < model.triangles.size(); ++t) {
    const Chart& chart = atlas.charts[atlas.chart_of[t]];
    Vec2<double> p[3];
    for (std::size_t c = 0; c < 3; ++c) {
      p[c] = chart.texel(model.position[model.triangles[t][c]], atlas.density, atlas.padding);
      EXPECT_GE(p[c].x, chart.x + atlas.padding - 1e-9);
      EXPECT_LE(p[c].x, chart.x + chart.width - atlas.padding + 1e-9);
      EXPECT_GE(p[c].y, chart.y + atlas.padding - 1e-9);
      EXPECT_LE(p[c].y, chart.y + chart.height - atlas.padding + 1e-9);
    }
    for (int y = 0; y < atlas.side; ++y) {
      for (int x = chart.x; x < chart.x + chart.width; ++x) {
        const auto side = [&](int i, int k) {
          return (p[k].x - p[i].x) * (y + 0.5 - p[i].y) - (p[k].y - p[i].y) * (x + 0.5 - p[i].x);
        };
        const double a = side(0, 1), b = side(1, 2), c = side(2, 0);
        constexpr double kInside = 1e-6;
        if (std::min({a, b, c}) < kInside && std::max({a, b, c}) > -kInside) continue;
        int& of =
            owner[static_cast<std::size_t>(y) * static_cast<std::size_t>(atlas.side) + static_cast<std::size_t>(x)];
        EXPECT_EQ(of, -1);
        of = static_cast<int>(t);
      }
    }
  }
}

TEST(Atlas, GivesACubeASheetForEachSide) {
  const Model model = testing::cube(2);
  const Atlas atlas = atlas_of(model);
  EXPECT_EQ(atlas.charts.size(), 6U);
  expect_no_overlap(model, atlas);
}

TEST(Atlas, OfASphereDoesNotFoldAndIsNotSteep) {
  const Model model = testing::sphere(8);
  const Atlas atlas = atlas_of(model);
  expect_no_overlap(model, atlas);
  for (std::uint32_t t = 0; t < model.triangles.size(); ++t) {
    const auto& [a, b, c] = model.triangles[t];
    const Vec3d n = normalized(cross(model.position[b] - model.position[a], model.position[c] - model.position[a]));
    EXPECT_GE(dot(n, atlas.charts[atlas.chart_of[t]].normal), kSteepest - 1e-12);
  }
}

TEST(Atlas, SplitsASpiralStaircaseThatOverlapsInItsProjection) {
  // One and a half turns of a ramp: all of it looks up, and parts lie above each other.
  const Model ramp = testing::sheet(60, 3, [](double u, double v) {
    const double angle = 9.42 * u, r = 0.5 + 0.5 * v;
    return Vec3d{r * std::sin(angle), r * std::cos(angle), 0.3 * u};
  });
  const Atlas atlas = atlas_of(ramp);
  EXPECT_GE(atlas.charts.size(), 2U);
  expect_no_overlap(ramp, atlas);
}

TEST(Atlas, PullsTwoSheetsAtTheSamePlaceApart) {
  Model model = testing::sheet(3, 3, [](double u, double v) { return Vec3d{u, v, 0}; });
  append(model, model);
  const Atlas atlas = atlas_of(model);
  expect_no_overlap(model, atlas);
}

TEST(Atlas, KeepsLengthsInProportion) {
  const Model model = testing::sheet(4, 4, [](double u, double v) { return Vec3d{2 * u, v, 0}; });
  const Atlas atlas = atlas_of(model, 256);
  ASSERT_EQ(atlas.charts.size(), 1U);
  const Chart& chart = atlas.charts[0];
  EXPECT_GT(chart.width, 240);  // the largest that fits, to a hundredth and a texel
  EXPECT_NEAR(chart.width - 7, 2 * (chart.height - 7), 3);
  EXPECT_LT(dot(cross(chart.normal, chart.tangent) - chart.up, cross(chart.normal, chart.tangent) - chart.up), 1e-24);
}

TEST(Atlas, SaysWhenItsChartsDoNotFit) {
  Model many;
  for (int i = 0; i < 200; ++i) {
    append(many, testing::sheet(1, 1, [&](double u, double v) { return Vec3d{u + 3 * i, v, 0.0}; }));
  }
  Atlas atlas = make_charts(many.position, many.triangles);
  // The joined sheets are one row, or two hundred charts of at least three texels a side.
  EXPECT_FALSE(place_charts(atlas, 2));
  EXPECT_TRUE(place_charts(atlas, 64));
}

TEST(Atlas, HoldsOneTriangleAndOneWithoutArea) {
  const Model one{.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}, .color = {}};
  EXPECT_EQ(atlas_of(one).charts.size(), 1U);
  const Model none{.position = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, .triangles = {{0, 1, 2}}, .color = {}};
  EXPECT_EQ(atlas_of(none).charts.size(), 1U);
}

}  // namespace
}  // namespace kiln
