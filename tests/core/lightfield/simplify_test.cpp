#include "core/lightfield/simplify.h"

#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "tests/core/lightfield/lit_models.h"

namespace kiln {
namespace {

using testing::border_edges;
using testing::colour_at;
using testing::edges_in_space;
using testing::euler;
using testing::expect_sound;
using testing::flat;
using testing::hills;
using testing::sheet;
using testing::sphere;

LitMesh simplified(const LitMesh& lit, const Simplify& params) {
  Threads threads(2);
  return simplify(lit, params, threads).lit;
}

double area_of(const Mesh& m) { return surface_area(m); }

class EitherCollapse : public ::testing::TestWithParam<Collapse> {};
INSTANTIATE_TEST_SUITE_P(Simplify, EitherCollapse, ::testing::Values(Collapse::edge, Collapse::half_edge));

TEST_P(EitherCollapse, LeavesAPlaneOfLinearLightWithTwoTrianglesAndNoError) {
  // Linear colour over a plane is what one triangle shows exactly: eq. 7 is zero for every collapse that keeps the
  // outline.
  const auto linear = [](const Vec3f& p) { return Vec3f{0.5F + p.x, 0.5F + 0.5F * p.y, 0.5F - p.x}; };
  const LitMesh lit = sheet(12, flat, linear);
  Threads threads(1);
  const SimplifyResult out = simplify(lit, {.triangles = 2, .collapse = GetParam()}, threads);
  expect_sound(out.lit);
  EXPECT_EQ(out.lit.mesh.triangles.size(), 2U);
  EXPECT_TRUE(out.reached);
  EXPECT_NEAR(area_of(out.lit.mesh), 1, 1e-4);  // eps of least_point draws off the outline by 1e-5 of an edge
  EXPECT_LT(out.error, 1e-3);
  for (std::size_t v = 0; v < out.lit.mesh.position.size(); ++v)
    EXPECT_LT(length(colour_at(out.lit, v) - linear(out.lit.mesh.position[v])), 1e-3F);
}

TEST_P(EitherCollapse, PutsItsTrianglesWhereLightChanges) {
  const auto stripe = [](const Vec3f& p) {
    const float x = p.x / 0.08F;
    return Vec3f{1, 1, 1} * (std::exp(-x * x) * (2 + std::sin(50 * p.y)));
  };
  const LitMesh out = simplified(sheet(40, flat, stripe), {.triangles = 320, .collapse = GetParam()});
  expect_sound(out);
  std::size_t near = 0;
  for (const Vec3f& p : out.mesh.position) near += std::abs(p.x) < 0.2F;
  EXPECT_GT(near, 4 * (out.mesh.position.size() - near));  // four tenths of the sheet
}

TEST_P(EitherCollapse, SeesHighlightsThatTheAverageColourHides) {
  // Two halves of one mean colour: constant light, and light of band 2 on the right half of the sheet in bars.
  LitMesh lit = sheet(40, flat, testing::grey, 2);
  for (std::size_t v = 0; v < lit.mesh.position.size(); ++v) {
    const Vec3f p = lit.mesh.position[v];
    if (p.x > 0) lit.field.of(v)[6] = std::sin(40 * p.x) * std::sin(40 * p.y);
  }
  const LitMesh out = simplified(lit, {.triangles = 800, .collapse = GetParam()});
  std::size_t right = 0;
  for (const Vec3f& p : out.mesh.position) right += p.x > 0;
  EXPECT_GT(right, 4 * (out.mesh.position.size() - right));
}

TEST_P(EitherCollapse, KeepsASphereClosedAndRound) {
  const LitMesh out = simplified(sphere(16), {.triangles = 400, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_EQ(out.mesh.triangles.size(), 400U);
  EXPECT_EQ(border_edges(out.mesh), 0U);
  EXPECT_EQ(euler(out.mesh), 2);
  // As tests/core/reduce/collapse_test.cpp: how deep a triangle of that size cuts into the ball.
  const double depth = 0.5 - std::sqrt(0.25 - 3.1416 / 400 / 0.433 / 3);
  // Quadrics of planes that are chords already draw vertices outwards: measured 1.11 depths, and 1 of half-edges.
  for (const Vec3f& p : out.mesh.position) EXPECT_NEAR(length(p), 0.5, 1.2 * depth);
}

TEST_P(EitherCollapse, StopsAtWhatTopologyAllowsAndSaysSo) {
  Threads threads(1);
  const SimplifyResult ball = simplify(sphere(6), {.triangles = 0, .collapse = GetParam()}, threads);
  expect_sound(ball.lit);
  EXPECT_FALSE(ball.reached);
  EXPECT_GE(ball.lit.mesh.triangles.size(), 4U);
  EXPECT_LE(ball.lit.mesh.triangles.size(), 24U);  // needles and turned triangles may bar the last few
  EXPECT_EQ(euler(ball.lit.mesh), 2);
  const SimplifyResult one = simplify(sheet(1, flat), {.triangles = 0, .collapse = GetParam()}, threads);
  EXPECT_FALSE(one.reached);
  EXPECT_EQ(one.lit.mesh.triangles.size(), 1U);  // no piece vanishes
}

TEST_P(EitherCollapse, NeverTurnsATriangleOfAHeightFieldOver) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed, 3);
    LitMesh lit = sheet(24, flat, [&](const Vec3f&) { return Vec3f{random.uniform(), random.uniform(), 0}; });
    for (Vec3f& p : lit.mesh.position) p.z = 0.02F * random.uniform();
    Simplify params{.triangles = 40 + 50 * static_cast<std::size_t>(seed), .collapse = GetParam()};
    const LitMesh out = simplified(lit, params);
    expect_sound(out);
    // Zero is a triangle that stands upright on the border.
    for (const Triangle& t : out.mesh.triangles) EXPECT_GE(area_vector(out.mesh, t).z, 0);
  }
}

TEST_P(EitherCollapse, AnErrorBoundEndsItBeforeTheTarget) {
  const auto waves = [](const Vec3f& p) { return Vec3f{1, 1, 1} * (1 + std::sin(20 * p.x) * std::cos(15 * p.y)); };
  Threads threads(1);
  std::size_t before = 1'000'000;
  for (const double bound : {0.001, 0.01, 0.1}) {
    const SimplifyResult out =
        simplify(sheet(40, flat, waves), {.triangles = 0, .max_error = bound, .collapse = GetParam()}, threads);
    EXPECT_LE(out.error, bound);
    EXPECT_GT(out.error, 0.5 * bound);  // steps are small against the sum
    EXPECT_LT(out.lit.mesh.triangles.size(), before);
    before = out.lit.mesh.triangles.size();
  }
}

/// All bits of a result.
std::vector<unsigned char> bytes_of(const LitMesh& lit) {
  std::vector<unsigned char> out;
  const auto put = [&](const auto& array) {
    const auto* p = reinterpret_cast<const unsigned char*>(array.data());
    out.insert(out.end(), p, p + array.size() * sizeof array[0]);
  };
  each_attribute(lit.mesh, put);
  put(lit.mesh.triangles), put(lit.mesh.part), put(lit.field.coefficients);
  return out;
}

/// A dark floor with a bright square lamp in its middle, which has vertices of its own.
LitMesh floor_with_lamp() {
  constexpr std::uint32_t kSide = 24;
  LitMesh lit{.mesh = {}, .field = {.degree = 0, .coefficients = {}}};
  for (std::uint32_t part = 0; part < 2; ++part) {
    for (std::uint32_t i = 0; i <= kSide; ++i) {
      for (std::uint32_t j = 0; j <= kSide; ++j) {
        lit.mesh.position.push_back({static_cast<float>(i) / kSide - 0.5F, 0, static_cast<float>(j) / kSide - 0.5F});
        lit.mesh.normal.push_back({0, 1, 0});
        lit.field.coefficients.insert(lit.field.coefficients.end(), 3, part == 0 ? 1.0F : 40.0F);
      }
    }
  }
  const auto within = [](std::uint32_t i) { return i >= 9 && i < 15; };
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j) {
      const std::uint32_t part = within(i) && within(j) ? 1 : 0;
      const std::uint32_t v = part * (kSide + 1) * (kSide + 1) + i * (kSide + 1) + j, w = v + kSide + 1;
      lit.mesh.triangles.push_back({v, v + 1, w});
      lit.mesh.triangles.push_back({w, v + 1, w + 1});
      lit.mesh.part.insert(lit.mesh.part.end(), 2, part);
    }
  }
  return lit;
}

TEST(Simplify, ALampOnAFloorKeepsItsPlace) {
  const LitMesh out = simplified(floor_with_lamp(), {.max_error = 0.01});
  EXPECT_LT(out.mesh.triangles.size(), 100U);
  double area = 0;
  Vec3d middle;
  for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t) {
    if (out.mesh.part[t] == 0) continue;
    const double own = triangle_area(out.mesh, out.mesh.triangles[t]);
    area += own;
    middle += to_double(centroid(out.mesh, out.mesh.triangles[t])) * own;
  }
  // An error of .01 lets area .01^2 x 6 (hats) x 101 (mean square of the light) / 39^2 (of the jump) = 4e-5 be swept.
  EXPECT_NEAR(area, 1.0 / 16, 1e-4);
  EXPECT_NEAR(length(middle / area), 0, 1e-3);
}

TEST(Simplify, GivesTheSameBitsOnAnyNumberOfThreads) {
  const auto waves = [](const Vec3f& p) { return Vec3f{1, p.x, 1} * (1 + std::sin(20 * p.x)); };
  std::vector<std::vector<unsigned char>> results;
  for (const int count : {1, 2, 5}) {
    Threads threads(count);
    results.push_back(bytes_of(simplify(sheet(50, hills, waves, 2), {.triangles = 800}, threads).lit));
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST(Simplify, DoesNotDependOnTheBrightnessOfTheLight) {
  const auto waves = [](float scale) {
    return [=](const Vec3f& p) { return Vec3f{1, 1, 1} * (scale * (1 + std::sin(20 * p.x))); };
  };
  const LitMesh dim = simplified(sheet(30, hills, waves(0x1p-20F)), {.triangles = 500});
  const LitMesh bright = simplified(sheet(30, hills, waves(0x1p+20F)), {.triangles = 500});
  EXPECT_EQ(dim.mesh.position, bright.mesh.position);  // powers of two change no rounding
  EXPECT_EQ(dim.mesh.triangles, bright.mesh.triangles);
}

TEST(Simplify, WithoutLightOnlyShapeCounts) {
  const auto black = [](const Vec3f&) { return Vec3f{}; };
  const LitMesh out = simplified(sheet(30, hills, black), {.triangles = 300});
  expect_sound(out);
  EXPECT_EQ(out.mesh.triangles.size(), 300U);
}

TEST(Simplify, AnInputBelowTheTargetStaysAsItIs) {
  const LitMesh lit = sheet(5, hills);
  const LitMesh out = simplified(lit, {.triangles = 50});
  EXPECT_EQ(bytes_of(out), bytes_of(lit));
}

TEST(Simplify, TellsHowFarItIs) {
  Threads threads(1);
  std::vector<std::uint64_t> seen;
  Simplify params{.triangles = 100};
  params.progress = [&](std::uint64_t done, std::uint64_t all) {
    EXPECT_EQ(all, 2 * 60 * 60 - 100U);
    EXPECT_LE(done, all);
    EXPECT_TRUE(seen.empty() || done >= seen.back());
    seen.push_back(done);
  };
  simplify(sheet(60, hills), params, threads);
  EXPECT_GT(seen.size(), 3U);
}

TEST(Simplify, CanBeStopped) {
  Threads threads(1);
  threads.stop();
  EXPECT_THROW(simplify(sheet(20, flat), {.triangles = 2}, threads), Cancelled);
}

/// Two sheets side by side with vertices of their own on the common line, of other normals, colours, uvs and parts.
LitMesh seamed(std::uint32_t n) {
  LitMesh a = sheet(n, flat, [](const Vec3f& p) { return Vec3f{0.5F + 0.3F * std::sin(30 * p.y), 0.2F, 0}; });
  LitMesh b = sheet(n, flat, [](const Vec3f& p) { return Vec3f{0, 0.5F + 0.3F * std::cos(25 * p.y), 1}; });
  a.mesh.uv0.assign(a.mesh.position.size(), {0.25F, 0.25F});
  for (Vec3f& p : b.mesh.position) p.x += 1;
  for (Vec3f& normal : b.mesh.normal) normal = normalized(Vec3f{0.3F, 0, 1});
  b.mesh.uv0.assign(b.mesh.position.size(), {0.75F, 0.25F});
  const auto first = static_cast<std::uint32_t>(a.mesh.position.size());
  for (std::uint32_t v = 0; v < b.mesh.position.size(); ++v) append_vertex(a, b, v);
  for (const Triangle& t : b.mesh.triangles) {
    a.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    a.mesh.part.push_back(1);
  }
  return a;
}

TEST_P(EitherCollapse, ASeamMovesAsOneAndKeepsBothSides) {
  const LitMesh lit = seamed(16);
  const std::size_t outline = 6 * 16;
  ASSERT_EQ(border_edges(lit.mesh), outline);
  const LitMesh out = simplified(lit, {.triangles = 200, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_LE(out.mesh.triangles.size(), 200U);
  EXPECT_GE(out.mesh.triangles.size(), 199U);  // inner collapses take two at once
  EXPECT_EQ(euler(out.mesh), 1);
  std::size_t on_seam = 0;
  for (const auto& [edge, count] : edges_in_space(out.mesh)) EXPECT_EQ(count, 1);
  for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : out.mesh.triangles[t]) {
      const Vec3f p = out.mesh.position[v];
      const bool right = out.mesh.part[t] == 1;
      EXPECT_NEAR(out.mesh.uv0[v].x, right ? 0.75F : 0.25F, 1e-6);
      EXPECT_EQ(out.mesh.normal[v].x > 0.1F, right);
      EXPECT_EQ(colour_at(out, v).z > 0.5F, right);
      EXPECT_TRUE(right ? p.x >= 0.5F - 1e-4F : p.x <= 0.5F + 1e-4F);  // as far as eps of least_point
      on_seam += std::abs(p.x - 0.5F) < 1e-4F;
    }
  }
  EXPECT_GT(on_seam, 4U);
  // No crack: borders lie on the outline, none on the seam.
  double border = 0;
  const auto edges = edges_in_space(out.mesh);
  for (const auto& [edge, count] : edges) {
    if (edges.contains({edge.second, edge.first})) continue;
    border += length(to_double(out.mesh.position[edge.first] - out.mesh.position[edge.second]));
  }
  EXPECT_NEAR(border, 6, 1e-3);
}

TEST_P(EitherCollapse, AttributesAreThoseOfThePlaceOnTheSurface) {
  LitMesh lit = sheet(20, flat, [](const Vec3f& p) { return Vec3f{p.x + 1, p.y + 1, 1}; });
  for (const Vec3f& p : lit.mesh.position) {
    lit.mesh.uv0.push_back({p.x, p.y});
    lit.mesh.uv1.push_back({2 * p.x, -p.y});
    lit.mesh.color.push_back({p.x, p.y, 0.5F, 1});
    lit.mesh.tangent.push_back({1, 0, 0, -1});
  }
  const LitMesh out = simplified(lit, {.triangles = 60, .collapse = GetParam()});
  expect_sound(out);
  for (std::size_t v = 0; v < out.mesh.position.size(); ++v) {
    const Vec3f p = out.mesh.position[v];
    EXPECT_NEAR(out.mesh.uv0[v].x, p.x, 2e-4);  // the place may lie off the edge whose attributes it takes
    EXPECT_NEAR(out.mesh.uv1[v].y, -p.y, 2e-4);
    EXPECT_NEAR(out.mesh.color[v].x, p.x, 2e-4);
    EXPECT_EQ(out.mesh.tangent[v], (Vec4f{1, 0, 0, -1}));
  }
}

TEST_P(EitherCollapse, FlatShadedModelsSimplifyAndStayShut) {
  const LitMesh lit = testing::flat_shaded(sphere(12));
  const LitMesh out = simplified(lit, {.triangles = 300, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_EQ(out.mesh.triangles.size(), 300U);
  EXPECT_EQ(border_edges(out.mesh), 0U);
  EXPECT_EQ(euler(out.mesh), 2);
  for (const auto& [edge, count] : edges_in_space(out.mesh)) EXPECT_EQ(count, 1);
  const double depth = 0.5 - std::sqrt(0.25 - 3.1416 / 300 / 0.433 / 3);  // as above
  for (const Vec3f& p : out.mesh.position) EXPECT_NEAR(length(p), 0.5, 1.2 * depth);
}

TEST_P(EitherCollapse, WhereSeamsMeetNothingOpens) {
  // Four quarters of a sheet, each with vertices, uvs and a part of its own: two seams that cross in the middle.
  LitMesh lit = sheet(16, hills, [](const Vec3f& p) {
    return Vec3f{1 + std::sin(11 * p.x), 1, 1 + std::sin(8 * p.y)};
  });
  lit.mesh.uv0.assign(lit.mesh.position.size(), {});
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> own;
  for (std::size_t t = 0; t < lit.mesh.triangles.size(); ++t) {
    const Vec3f c = centroid(lit.mesh, lit.mesh.triangles[t]);
    const std::uint32_t part = (c.x > 0 ? 1 : 0) + (c.y > 0 ? 2 : 0);
    lit.mesh.part[t] = part;
    for (std::uint32_t& v : lit.mesh.triangles[t]) {
      const auto key = std::pair(v, part);
      if (!own.contains(key)) {
        own[key] = append_vertex(lit, lit, v);
        lit.mesh.uv0.back() = {static_cast<float>(part), 0};
      }
      v = own[key];
    }
  }
  const LitMesh out = simplified(lit, {.triangles = 60, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_LE(out.mesh.triangles.size(), 60U);
  EXPECT_EQ(euler(out.mesh), 1);
  const auto edges = edges_in_space(out.mesh);
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    if (edges.contains({edge.second, edge.first})) continue;
    for (const std::uint32_t v : {edge.first, edge.second}) {
      const Vec3f p = out.mesh.position[v];
      EXPECT_NEAR(std::max(std::abs(p.x), std::abs(p.y)), 0.5, 1e-3);  // a border is the outline, never a crack
    }
  }
  for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t)
    for (const std::uint32_t v : out.mesh.triangles[t])
      EXPECT_NEAR(out.mesh.uv0[v].x, static_cast<float>(out.mesh.part[t]), 1e-6);
}

/// A sphere in bands, each a chart with vertices of its own and its uvs elsewhere.
LitMesh banded_sphere() {
  LitMesh lit = sphere(12, [](const Vec3f& p) { return Vec3f{1 + p.x, 1, 1 + p.y}; });
  lit.mesh.uv0.assign(lit.mesh.position.size(), {});
  std::map<std::pair<std::uint32_t, int>, std::uint32_t> own;
  for (Triangle& t : lit.mesh.triangles) {
    const auto band = static_cast<int>(12 * (centroid(lit.mesh, t).y + 0.5F));
    for (std::uint32_t& v : t) {
      const auto key = std::pair(v, band);
      if (!own.contains(key)) {
        own[key] = append_vertex(lit, lit, v);
        const Vec3f p = lit.mesh.position[v];
        lit.mesh.uv0.back() = {std::atan2(p.z, std::abs(p.x)) + 10 * static_cast<float>(band), p.y};
      }
      v = own[key];
    }
  }
  return lit;
}

TEST_P(EitherCollapse, NarrowChartsAreCrossedAndNothingOpens) {
  // Along seams alone each of eleven loops between the bands keeps a triangle: 88 triangles were left so.
  const LitMesh out = simplified(banded_sphere(), {.triangles = 40, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_LE(out.mesh.triangles.size(), 40U);
  EXPECT_EQ(border_edges(out.mesh), 0U);
  EXPECT_EQ(euler(out.mesh), 2);
  for (const auto& [edge, count] : edges_in_space(out.mesh)) EXPECT_EQ(count, 1);
  for (const Triangle& t : out.mesh.triangles) EXPECT_GT(dot(area_vector(out.mesh, t), centroid(out.mesh, t)), 0);
}

TEST(Simplify, TexturesThatWouldSlideHaveTheirPrice) {
  // Constant light on a flat sheet: only the texture tells the halves apart. Left it bends, right it is straight.
  LitMesh lit = sheet(40, flat);
  for (const Vec3f& p : lit.mesh.position)
    lit.mesh.uv0.push_back({p.x, p.x < 0 ? p.y + 0.02F * std::sin(60 * p.x) * std::sin(60 * p.y) : p.y});
  const LitMesh out = simplified(lit, {.triangles = 800});
  std::size_t left = 0;
  for (const Vec3f& p : out.mesh.position) left += p.x < 0;
  EXPECT_GT(left, 4 * (out.mesh.position.size() - left));
}

TEST_P(EitherCollapse, ABorderIsNeverPinched) {
  // Flat shading: every edge is a seam, those from one border across to another as well.
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed, 7);
    LitMesh lit = sheet(8, flat, [&](const Vec3f&) { return Vec3f{random.uniform(), random.uniform(), 0}; });
    std::erase_if(lit.mesh.triangles, [&](const Triangle& t) { return std::abs(centroid(lit.mesh, t).y) > 0.25F; });
    lit.mesh.part.assign(lit.mesh.triangles.size(), 0);
    const LitMesh out = simplified(testing::flat_shaded(lit), {.triangles = 10, .collapse = GetParam()});
    std::map<std::uint32_t, int> borders;
    const auto edges = edges_in_space(out.mesh);
    for (const auto& [edge, count] : edges)
      if (!edges.contains({edge.second, edge.first})) ++borders[edge.first];
    for (const auto& [place, count] : borders) EXPECT_EQ(count, 1) << seed;
  }
}

TEST_P(EitherCollapse, AFinOnASeamHoldsUpItselfAndNotTheGroundThatItStandsOn) {
  LitMesh lit = seamed(16);
  std::ranges::fill(lit.field.coefficients, 1.0F);
  const LitMesh fin = sheet(16, flat);
  const auto first = static_cast<std::uint32_t>(lit.mesh.position.size());
  for (std::uint32_t v = 0; v < fin.mesh.position.size(); ++v) {
    append_vertex(lit, lit, 0);
    const Vec3f p = fin.mesh.position[v];
    lit.mesh.position.back() = {0.5F, p.y, p.x + 0.5F};
    lit.mesh.normal.back() = {1, 0, 0};
  }
  for (const Triangle& t : fin.mesh.triangles) {
    lit.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    lit.mesh.part.push_back(2);
  }
  Threads threads(1);
  const LitMesh out = simplify(lit, {.triangles = 0, .max_error = 0.02, .collapse = GetParam()}, threads).lit;
  expect_sound(out);
  std::set<float> feet, under;  // on the line, of the fin and of the ground
  double area = 0;
  for (std::size_t t = 0; t < out.mesh.triangles.size(); ++t) {
    const bool upright = out.mesh.part[t] == 2;
    if (!upright) area += triangle_area(out.mesh, out.mesh.triangles[t]);
    for (const std::uint32_t v : out.mesh.triangles[t]) {
      const Vec3f p = out.mesh.position[v];
      if (std::abs(p.x - 0.5F) < 1e-3F && std::abs(p.z) < 1e-3F) (upright ? feet : under).insert(p.y);
    }
  }
  EXPECT_NEAR(area, 2, 1e-3);
  EXPECT_EQ(feet.size(), 17U);  // as they were
  EXPECT_LT(under.size(), 6U);
}

// Bad input.

LitMesh with_triangles(std::vector<Vec3f> position, std::vector<Triangle> triangles) {
  LitMesh lit;
  lit.mesh.position = std::move(position);
  lit.mesh.normal.assign(lit.mesh.position.size(), {0, 0, 1});
  lit.mesh.triangles = std::move(triangles);
  lit.mesh.part.assign(lit.mesh.triangles.size(), 0);
  testing::paint(lit, 0, testing::grey);
  return lit;
}

TEST_P(EitherCollapse, NothingAndPointsAloneAreNothing) {
  Threads threads(1);
  for (const LitMesh& lit : {LitMesh{}, with_triangles({{0, 0, 0}, {1, 0, 0}}, {})}) {
    const SimplifyResult out = simplify(lit, {.triangles = 0, .collapse = GetParam()}, threads);
    EXPECT_TRUE(out.lit.mesh.triangles.empty() && out.lit.mesh.position.empty());
    EXPECT_TRUE(out.reached);
  }
}

TEST_P(EitherCollapse, DegenerateAndRepeatedTrianglesAndLoneVerticesGo) {
  LitMesh lit = sheet(8, flat);
  const std::size_t triangles = lit.mesh.triangles.size();
  append_vertex(lit, lit, 0);
  lit.mesh.position.back() = {5, 5, 5};
  append_vertex(lit, lit, 7);  // a second vertex in the place of 7
  const auto twin = static_cast<std::uint32_t>(lit.mesh.position.size() - 1);
  for (const Triangle& t : {Triangle{0, 0, 1}, Triangle{7, twin, 3}, lit.mesh.triangles[5],
                            Triangle{lit.mesh.triangles[9][1], lit.mesh.triangles[9][2], lit.mesh.triangles[9][0]}}) {
    lit.mesh.triangles.push_back(t);
    lit.mesh.part.push_back(0);
  }
  const LitMesh out = simplified(lit, {.triangles = 1000, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_EQ(out.mesh.triangles.size(), triangles);
  EXPECT_EQ(simplified(lit, {.triangles = 2, .collapse = GetParam()}).mesh.triangles.size(), 2U);
}

TEST_P(EitherCollapse, ThreeSheetsOnALineStayOnIt) {
  // A book of three pages: more than two triangles on every edge of its spine.
  LitMesh book;
  book.field.degree = 0;
  for (int page = 0; page < 3; ++page) {
    LitMesh sheet_of = sheet(12, flat);
    const float angle = 2.1F * static_cast<float>(page);
    for (Vec3f& p : sheet_of.mesh.position) p = {(p.x + 0.5F) * std::cos(angle), p.y, (p.x + 0.5F) * std::sin(angle)};
    const auto first = static_cast<std::uint32_t>(book.mesh.position.size());
    for (std::uint32_t v = 0; v < sheet_of.mesh.position.size(); ++v) append_vertex(book, sheet_of, v);
    for (const Triangle& t : sheet_of.mesh.triangles) {
      book.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      book.mesh.part.push_back(0);
    }
  }
  Threads threads(1);
  const SimplifyResult out = simplify(book, {.triangles = 0, .collapse = GetParam()}, threads);
  expect_sound(out.lit);
  EXPECT_LT(out.lit.mesh.triangles.size(), book.mesh.triangles.size() / 4);
  std::map<float, int> spine;
  for (const Vec3f& p : out.lit.mesh.position) {
    if (p.x == 0 && p.z == 0) ++spine[p.y];
  }
  EXPECT_EQ(spine.size(), 13U);  // what cannot be glued stays
  for (const auto& [y, vertices] : spine) EXPECT_EQ(vertices, 3);
}

TEST_P(EitherCollapse, SheetsThatLieOnEachOtherStayTwo) {
  LitMesh lit = sheet(12, flat);
  const LitMesh front = lit;
  const auto first = static_cast<std::uint32_t>(lit.mesh.position.size());
  for (std::uint32_t v = 0; v < front.mesh.position.size(); ++v) append_vertex(lit, front, v);
  for (const Triangle& t : front.mesh.triangles) {
    lit.mesh.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
    lit.mesh.part.push_back(0);
  }
  const LitMesh out = simplified(lit, {.triangles = 40, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_LE(out.mesh.triangles.size(), 40U);
  double front_area = 0;
  for (const Triangle& t : out.mesh.triangles) front_area += std::max(0.0F, area_vector(out.mesh, t).z) / 2;
  EXPECT_NEAR(front_area, 1, 1e-3);
}

TEST_P(EitherCollapse, AMeshWoundAgainstItselfAndABowTieAreNeverPulledApart) {
  // Neighbours of opposite winding, and two fans that touch in one vertex.
  LitMesh lit = sheet(10, flat);
  for (std::size_t t = 0; t < lit.mesh.triangles.size(); t += 7)
    std::swap(lit.mesh.triangles[t][1], lit.mesh.triangles[t][2]);
  const LitMesh wound = simplified(lit, {.triangles = 0, .max_error = 1e-4, .collapse = GetParam()});  // no ears cut
  expect_sound(wound);
  EXPECT_LT(wound.mesh.triangles.size(), lit.mesh.triangles.size());
  double area = 0;
  for (const Triangle& t : wound.mesh.triangles) area += triangle_area(wound.mesh, t);
  EXPECT_NEAR(area, 1, 1e-3);
  const LitMesh bow = with_triangles({{0, 0, 0}, {1, 1, 0}, {1, 2, 0}, {-1, 1, 0}, {-1, 2, 0}}, {{0, 1, 2}, {0, 4, 3}});
  EXPECT_EQ(simplified(bow, {.triangles = 0, .collapse = GetParam()}).mesh.triangles.size(), 2U);
}

TEST_P(EitherCollapse, AHubOfThousandsOfTrianglesHoldsNobodyUp) {
  // A disc as CAD programs write it: pairs of neighbours would be two hundred million.
  constexpr std::uint32_t kSpokes = 20'000;
  std::vector<Vec3f> position{{0, 0, 0}};
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < kSpokes; ++i) {
    const double phi = 2 * std::numbers::pi * i / kSpokes;
    position.push_back(to_float(Vec3d{std::cos(phi), std::sin(phi), 0} * 0.5));
    triangles.push_back({0, i + 1, (i + 1) % kSpokes + 1});
  }
  const LitMesh out = simplified(with_triangles(position, triangles), {.triangles = 100, .collapse = GetParam()});
  expect_sound(out);
  EXPECT_EQ(out.mesh.triangles.size(), 100U);
  // A polygon of 100 corners on the circle or about it.
  EXPECT_NEAR(surface_area(out.mesh), std::numbers::pi / 4, 2e-3);
}

TEST_P(EitherCollapse, ZeroNormalsNeedlesAndRandomSoupEndSomewhere) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Random random(seed, 5);
    std::vector<Vec3f> position;
    std::vector<Triangle> triangles;
    const auto vertices = 4 + static_cast<std::uint32_t>(40 * random.uniform());
    const auto coordinate = [&] { return std::floor(3 * random.uniform()) * (random.uniform() < 0.2F ? 1e-7F : 1); };
    for (std::uint32_t v = 0; v < vertices; ++v) position.push_back({coordinate(), coordinate(), coordinate()});
    const auto any = [&] { return static_cast<std::uint32_t>(random.uniform() * static_cast<float>(vertices)); };
    for (int t = 0; t < 150; ++t) triangles.push_back({any(), any(), any()});
    LitMesh lit = with_triangles(position, triangles);
    for (std::uint32_t v = 0; v < vertices; v += 3) lit.mesh.normal[v] = {};
    expect_sound(simplified(lit, {.triangles = 0, .collapse = GetParam()}));
  }
}

}  // namespace
}  // namespace kiln
