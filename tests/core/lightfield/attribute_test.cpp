// Fields that are no light: any number of channels, with noise that two draws tell from detail; and how far a surface
// may move.
#include <gtest/gtest.h>

#include "core/lightfield/field_products.h"
#include "core/lightfield/simplify.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/pieces.h"
#include "tests/core/lightfield/lit_models.h"

namespace kiln {
namespace {

using testing::expect_sound;
using testing::flat;
using testing::hills;
using testing::sheet;
using testing::sphere;

/// `channels` numbers a vertex, from its place.
LightField field_by_place(const Mesh& mesh, std::size_t channels,
                          const std::function<float(const Vec3f&, std::size_t)>& value) {
  LightField out{.degree = 0, .coefficients = {}, .channels = channels};
  for (const Vec3f& p : mesh.position)
    for (std::size_t c = 0; c < channels; ++c) out.coefficients.push_back(value(p, c) / testing::kY0);
  return out;
}

/// The mean and half the difference of two draws of every channel, each off by a normal number times `sigma`.
LightField drawn_twice(const LightField& truth, float sigma) {
  LightField out{.degree = 0, .coefficients = {}, .channels = 2 * truth.channels, .noise = truth.channels};
  Random random(7, 7);
  const auto draw = [&] {
    float sum = -6;  // of twelve: nearly normal
    for (int i = 0; i < 12; ++i) sum += random.uniform();
    return sigma * sum / testing::kY0;
  };
  for (std::size_t v = 0; v < truth.vertices(); ++v) {
    std::vector<float> a, b;
    for (const float x : truth.of(v)) a.push_back(x + draw()), b.push_back(x + draw());
    for (std::size_t c = 0; c < a.size(); ++c) out.coefficients.push_back(0.5F * (a[c] + b[c]));
    for (std::size_t c = 0; c < a.size(); ++c) out.coefficients.push_back(0.5F * (a[c] - b[c]));
  }
  return out;
}

/// A mesh of the shape of `lit` with another field.
LitMesh with_field(const LitMesh& lit, LightField field) { return {.mesh = lit.mesh, .field = std::move(field)}; }

SimplifyResult simplified(LitMesh lit, const Simplify& params) {
  Threads threads(2);
  return simplify(std::move(lit), params, threads);
}

TEST(FieldProducts, OfDegreeZeroAreEuclids) {
  const LitMesh lit = sheet(3, flat);
  const LightField field = field_by_place(
      lit.mesh, 7, [](const Vec3f& p, std::size_t c) { return p.x * static_cast<float>(c) + p.y * p.y; });
  const FieldProducts products(field);
  const std::vector<std::uint32_t> others{5, 1, 9};
  std::vector<float> found;
  products.of_differences(4, others, {0, 0, 1}, found);
  std::size_t at = 0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      double sum = 0;
      for (std::size_t c = 0; c < 7; ++c)
        sum += (double{field.of(others[i])[c]} - field.of(4)[c]) * (double{field.of(others[k])[c]} - field.of(4)[c]);
      const double y0 = double{testing::kY0};
      EXPECT_NEAR(found[at++], sum * y0 * y0, 1e-6 * std::abs(sum));  // differences are kept in float
    }
  }
  EXPECT_NEAR(products.squared_distance(4, 1, {}), found[2], 1e-6);
}

TEST(FieldProducts, OfColoursAreThoseOfRadianceFunctions) {
  // Degree 0 of a field of degree 1 whose other band is nothing.
  const auto colour = [](const Vec3f& p) { return Vec3f{p.x, p.y, p.x * p.y}; };
  const LitMesh flat_light = sheet(3, flat, colour), round = sheet(3, flat, colour, 1);
  const FieldProducts a(flat_light.field), b(round.field);
  const std::vector<std::uint32_t> others{0, 1, 2, 6};
  std::vector<float> of_a, of_b;
  a.of_differences(5, others, {0, 0, 1}, of_a), b.of_differences(5, others, {0, 0, 1}, of_b);
  ASSERT_EQ(of_a.size(), of_b.size());
  for (std::size_t i = 0; i < of_a.size(); ++i) EXPECT_NEAR(of_a[i], of_b[i], 1e-6);
}

/// Diffuse light that is kept apart counts as what it sends on the colour of the surface.
TEST(FieldProducts, SeeDiffuseLightThatIsApart) {
  constexpr float kWhite = 3.5449077F;  // 2 sqrt(pi)
  LightField apart{.degree = 2, .coefficients = std::vector<float>(54, 0.25F)};
  LightField together = apart;
  apart.diffuse = {1, 2, 3, 1.5F, 1, 2};
  apart.diffuse_color = {0.5F, 0.25F, 0.75F};
  for (std::size_t v = 0; v < 2; ++v)
    for (std::size_t c = 0; c < 3; ++c)
      together.of(v)[9 * c] += kWhite * apart.diffuse_color[c] * apart.diffuse[3 * v + c];
  const FieldProducts a(apart), b(together);
  const Vec3d n{0, 0, 1};
  EXPECT_NEAR(a.squared_distance(0, 1, n), b.squared_distance(0, 1, n), 1e-5);  // floats
  EXPECT_NEAR(a.squared_norm(1, n), b.squared_norm(1, n), 1e-5);
  EXPECT_GT(a.squared_distance(0, 1, n), 0.1);
}

TEST(FieldProducts, OfTwoDrawsAreFreeOfNoiseInTheMean) {
  const LitMesh lit = sheet(60, flat);
  const auto slope = [](const Vec3f& p, std::size_t c) { return c == 0 ? p.x : 0.0F; };
  const LightField truth = field_by_place(lit.mesh, 8, slope), noisy = drawn_twice(truth, 0.1F);
  const FieldProducts products(noisy);
  double sum = 0, count = 0;
  std::vector<float> found;
  for (std::uint32_t v = 0; v + 1 < lit.mesh.position.size(); ++v) {
    if (v % 61 == 60) continue;
    products.of_differences(v, std::vector<std::uint32_t>{v + 1}, {0, 0, 1}, found);
    sum += found[0], ++count;
  }
  // Truth 1 / 60^2 = 2.8e-4. One draw would add 8 x 2 x .1^2 = .16; the spread of a product of two draws is
  // sqrt(8) 2 x .1^2 = .057, of the mean of 3660 neighbours (each in four) below .057 sqrt(4 / 3660) = .0019.
  EXPECT_NEAR(sum / count, 1.0 / 3600, 4 * 0.0019);
}

TEST(AttributeSimplify, ConstantTransferLeavesAPlaneTwoTriangles) {
  const LitMesh lit = sheet(24, flat);
  const auto even = [](const Vec3f&, std::size_t c) { return c == 0 ? 1.0F : 0.1F * static_cast<float>(c); };
  const SimplifyResult out =
      simplified(with_field(lit, field_by_place(lit.mesh, 40, even)), {.max_error = 1e-4, .max_reach = 1e-4});
  expect_sound(out.lit);
  EXPECT_EQ(out.lit.mesh.triangles.size(), 2U);
}

TEST(AttributeSimplify, NoiseIsNotTakenForDetail) {
  const LitMesh lit = sheet(40, flat);
  const auto even = [](const Vec3f&, std::size_t c) { return c == 0 ? 1.0F : 0.0F; };
  const LightField twice = drawn_twice(field_by_place(lit.mesh, 36, even), 0.02F);
  LightField once = twice;
  once.noise = 0;  // noise channels count like the others
  const Simplify params{.max_error = 0.02, .mean_square = 1};
  const std::size_t left = simplified(with_field(lit, twice), params).lit.mesh.triangles.size();
  const std::size_t kept = simplified(with_field(lit, once), params).lit.mesh.triangles.size();
  EXPECT_LT(left, 640U);   // a fifth: the luckiest go first, and are taken for worse than they are
  EXPECT_GT(kept, 1600U);  // half: noise of .02 in 36 channels is six times the bound
}

TEST(AttributeSimplify, AShadowEdgeKeepsItsVertices) {
  const LitMesh lit = sheet(40, flat);
  const auto shadow = [](const Vec3f& p, std::size_t c) {
    const float x = std::clamp((p.x + 0.3F * p.y) / 0.05F, -1.0F, 1.0F);
    return c == 0 ? 1 + 0.8F * x : 0.1F * x;
  };
  const SimplifyResult out = simplified(with_field(lit, field_by_place(lit.mesh, 16, shadow)), {.max_error = 0.01});
  expect_sound(out.lit);
  EXPECT_LT(out.lit.mesh.triangles.size(), 1600U);
  std::size_t near = 0;
  for (const Vec3f& p : out.lit.mesh.position) near += std::abs(p.x + 0.3F * p.y) < 0.1F;
  EXPECT_GT(near, 3 * (out.lit.mesh.position.size() - near));  // a fifth of the sheet
  // And light is what it was: the nearest place of the result has it.
  const ClosestPoint nearest(out.lit.mesh);
  double squares = 0;
  for (const Vec3f& p : lit.mesh.position) {
    const auto at = nearest.query(to_double(p), {});
    const Triangle& t = out.lit.mesh.triangles[at->triangle];
    double light = 0;
    const double weight[] = {1 - at->u - at->v, at->u, at->v};
    for (std::size_t k = 0; k < 3; ++k) light += weight[k] * double{out.lit.field.of(t[k])[0]} * double{testing::kY0};
    squares += std::pow(light - double{shadow(p, 0)}, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(lit.mesh.position.size())), 0.02);  // twice: it is an estimate
}

TEST(AttributeSimplify, ErrorsAreRelativeToTheGivenLight) {
  const LitMesh lit = sheet(40, flat);
  const auto waves = [](const Vec3f& p, std::size_t) { return std::sin(20 * p.x) * std::cos(15 * p.y); };
  const auto error_of = [&](double mean_square) {
    const Simplify params{.triangles = 400, .geometry_weight = 0, .mean_square = mean_square};
    return simplified(with_field(lit, field_by_place(lit.mesh, 1, waves)), params).error;
  };
  EXPECT_NEAR(error_of(1) / error_of(16), 4, 0.1);  // all but the little that flat regions pay for long edges
}

/// The farthest that vertices of `from` lie from `to`.
double farthest(const Mesh& from, const Mesh& to) {
  const ClosestPoint nearest(to);
  double most = 0;
  for (const Vec3f& p : from.position) most = std::max(most, nearest.query(to_double(p), {})->distance);
  return most;
}

TEST(CollapseReach, NoVertexOfTheInputLiesFarther) {
  for (const LitMesh& lit : {sphere(24), sheet(48, hills), testing::flat_shaded(sphere(16))}) {
    const double diagonal = double{piece_diagonals(lit.mesh)[0]};
    std::size_t before = lit.mesh.triangles.size() + 1;
    for (const double reach : {1e-4, 1e-3, 1e-2}) {
      const LitMesh out = simplified(lit, {.max_reach = reach}).lit;
      expect_sound(out);
      EXPECT_LE(farthest(lit.mesh, out.mesh), reach * diagonal * (1 + 1e-6));  // kept in float
      EXPECT_LE(farthest(out.mesh, lit.mesh), 1.15 * reach * diagonal);        // as the header says: measured 1.103
      EXPECT_LT(out.mesh.triangles.size(), before);
      before = out.mesh.triangles.size();
    }
    EXPECT_LT(before, lit.mesh.triangles.size() / 4);  // a hundredth of the diagonal allows that much
  }
}

TEST(CollapseReach, ASmallThingInALargeSceneKeepsItsShape) {
  LitMesh small = sphere(16), both = small;
  for (Vec3f& p : both.mesh.position) p = p * 0.01F + Vec3f{3, 0, 0};
  const LitMesh large = sheet(8, flat);
  const auto first = static_cast<std::uint32_t>(both.mesh.position.size());
  for (std::uint32_t v = 0; v < large.mesh.position.size(); ++v) append_vertex(both, large, v);
  for (const Triangle& t : large.mesh.triangles) {
    both.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    both.mesh.part.push_back(0);
  }
  const LitMesh out = simplified(both, {.max_reach = 1e-3}).lit;
  for (const Vec3f& p : out.mesh.position) {
    if (p.x < 1) continue;
    EXPECT_NEAR(length(p - Vec3f{3, 0, 0}), 0.005, 2e-3 * 0.01 * std::sqrt(3.0));  // diagonal of a ball's box
  }
}

TEST(Pieces, AreWhatTrianglesAndEqualPlacesConnect) {
  Mesh m;
  m.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0},
                {1, 1, 1}, {5, 5, 5}, {5, 5, 6}, {5, 6, 5}, {9, 9, 9}};
  m.triangles = {{0, 1, 2}, {3, 5, 4}, {6, 7, 8}};
  const std::vector<float> diagonal = piece_diagonals(m);
  for (const std::size_t v : {0, 1, 2, 3, 4, 5}) EXPECT_FLOAT_EQ(diagonal[v], std::sqrt(3.0F));
  for (const std::size_t v : {6, 7, 8}) EXPECT_FLOAT_EQ(diagonal[v], std::sqrt(2.0F));
  EXPECT_EQ(diagonal[9], 0);
}

}  // namespace
}  // namespace kiln
