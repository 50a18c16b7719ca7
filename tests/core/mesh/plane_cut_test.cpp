#include "core/mesh/plane_cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/base/random.h"

namespace kiln {
namespace {

const std::array<Vec2d, 3> kCorner{Vec2d{0, 0}, Vec2d{1, 0}, Vec2d{0, 1}};
constexpr double kNear = 1e-6;

double area_of(const PlaneCut& cut, const Triangle& t) {
  const auto& p = cut.points();
  return 0.5 * ((p[t[1]].x - p[t[0]].x) * (p[t[2]].y - p[t[0]].y) - (p[t[1]].y - p[t[0]].y) * (p[t[2]].x - p[t[0]].x));
}

/// Covers the triangle once, no triangle turned over, and every inner edge has two sides.
void expect_whole(const PlaneCut& cut, const std::vector<Triangle>& triangles) {
  double sum = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> turns;
  for (const Triangle& t : triangles) {
    EXPECT_GT(area_of(cut, t), 0);
    sum += area_of(cut, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = t[k], b = t[(k + 1) % 3];
      turns[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  EXPECT_NEAR(sum, 0.5, 1e-5);
  const auto on_border = [&](std::uint32_t p) {
    const Vec2d& at = cut.points()[p];
    return at.x == 0 || at.y == 0 || std::abs(at.x + at.y - 1) < 1e-12;
  };
  for (const auto& [edge, n] : turns) {
    if (n != 0) {
      EXPECT_TRUE(on_border(edge.first) && on_border(edge.second));
    }
  }
}

TEST(PlaneCut, WithoutSegmentsTheTriangleIsItself) {
  PlaneCut cut(kCorner, kNear);
  EXPECT_EQ(cut.triangles(), (std::vector<Triangle>{{2, 0, 1}}));
}

TEST(PlaneCut, ASegmentAcrossMakesThree) {
  PlaneCut cut(kCorner, kNear);
  cut.cut({{-0.1, 0.5}, {1.1, 0.5}});  // clipping is the caller's: the ends may lie outside
  const auto triangles = cut.triangles();
  expect_whole(cut, triangles);
  EXPECT_EQ(triangles.size(), 3U);
  EXPECT_EQ(cut.border().size(), 2U);
}

TEST(PlaneCut, ASquareInsideIsCutOut) {
  PlaneCut cut(kCorner, kNear);
  const std::array<Vec2d, 4> c{Vec2d{0.2, 0.2}, Vec2d{0.4, 0.2}, Vec2d{0.4, 0.4}, Vec2d{0.2, 0.4}};
  for (std::size_t k = 0; k < 4; ++k) cut.cut({c[k], c[(k + 1) % 4]});
  const auto triangles = cut.triangles();
  expect_whole(cut, triangles);
  double inside = 0, along = 0;
  for (const Triangle& t : triangles) {
    const auto& p = cut.points();
    const double x = (p[t[0]].x + p[t[1]].x + p[t[2]].x) / 3, y = (p[t[0]].y + p[t[1]].y + p[t[2]].y) / 3;
    if (x > 0.2 && x < 0.4 && y > 0.2 && y < 0.4) inside += area_of(cut, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = t[k], b = t[(k + 1) % 3];
      if (cut.along_segment(a, b)) along += std::hypot(p[a].x - p[b].x, p[a].y - p[b].y);
    }
  }
  EXPECT_NEAR(inside, 0.04, 1e-9);
  EXPECT_NEAR(along, 2 * 0.8, 1e-9);  // both sides of the square's border, and nothing beyond its corners
}

TEST(PlaneCut, BorderPointsOfNeighboursHangOnNothing) {
  PlaneCut cut(kCorner, kNear);
  for (int edge = 0; edge < 3; ++edge) {
    for (const double share : {0.1, 0.35, 0.9}) cut.add_border_point(edge, share);
  }
  const auto triangles = cut.triangles();
  expect_whole(cut, triangles);
  EXPECT_EQ(triangles.size(), 10U);  // a triangle with n points on its border has n + 1
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_FALSE(cut.along_segment(t[k], t[(k + 1) % 3]));
  }
}

TEST(PlaneCut, AnySegmentsLeaveTheTriangleWhole) {
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    std::uint64_t state = seed;
    const auto draw = [&] { return static_cast<double>((state = mix64(state)) >> 11U) * 0x1p-53; };
    PlaneCut cut(kCorner, kNear);
    const int segments = static_cast<int>(1 + seed % 12);
    for (int i = 0; i < segments; ++i) {
      Vec2d a{draw(), draw()}, b{draw(), draw()};
      for (Vec2d* p : {&a, &b}) {
        if (p->x + p->y > 1) *p = {1 - p->x, 1 - p->y};
        if (draw() < 0.3) p->y = 0;                                   // on an edge,
        if (draw() < 0.2) *p = {std::round(p->x), 0};                 // at a corner,
        if (draw() < 0.3) *p = {std::round(p->x * 4) / 4, p->y / 4};  // or where others begin
      }
      cut.cut({a, b});
    }
    expect_whole(cut, cut.triangles());
  }
}

}  // namespace
}  // namespace kiln
