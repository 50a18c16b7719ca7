// Radiance functions that a glTF carries: what comes out is what eyes see, and what is wrong is named.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/lightfield/seen.h"
#include "tests/core/artifact/radiance_samples.h"
#include "tests/core/lightfield/random_radiance.h"

namespace kiln {
namespace {

using test::has_warning;
using test::radiance_triangle;
using test::RadianceSample;
using test::Sample;

constexpr int kEyes = 20;
constexpr double kRounding = 3e-5;  // of floats, 25 coefficients of up to .5 times harmonics of up to 3

Result<LitScene> import_lit(const Bytes& file) {
  return import_lit_scene({.name = "scene.glb", .main = file, .resources = {}});
}

/// The field of vertex v of the mesh towards `view`, which is above its horizon.
Vec3d seen_at(const LitScene& lit, std::uint32_t v, const Vec3d& view) {
  const Vec3d n = to_double(lit.scene.mesh.normal[v]);
  RadianceFunction f{.degree = lit.field.degree, .normal = n, .coefficients = {}};
  for (const float c : lit.field.of(v)) f.coefficients.push_back(double{c});
  return evaluate(reflected(f), view);
}

/// `turn` takes directions of the file to those of the world.
template <class Turn>
void expect_seen(const LitScene& lit, const RadianceSample& sample, const Turn& turn, std::uint32_t first = 0) {
  ASSERT_GE(lit.field.vertices(), first + 3);
  Random random(1, 2);
  for (std::uint32_t v = 0; v < 3; ++v) {
    const RadianceFunction given = sample.reflected ? reflected(sample.function[v]) : sample.function[v];
    for (int eye = 0; eye < kEyes; ++eye) {
      const Vec3d view = testing::random_above(random, given.normal);
      const Vec3d truth = evaluate(given, view), seen = seen_at(lit, first + v, turn(view));
      EXPECT_NEAR(seen.x, truth.x, kRounding);
      EXPECT_NEAR(seen.y, truth.y, kRounding);
      EXPECT_NEAR(seen.z, truth.z, kRounding);
    }
  }
}

TEST(CarriedRadiance, IsSeenAsTheFileHasItInEitherBasisReflectedOrNot) {
  for (const RadianceBasis basis : {RadianceBasis::harmonics, RadianceBasis::polynomials}) {
    for (const bool reflected : {false, true}) {
      for (const int degree : {0, 1, 4}) {
        const RadianceSample sample = radiance_triangle(basis, degree, reflected);
        const auto lit = import_lit(sample.glb());
        ASSERT_TRUE(lit) << lit.error().message;
        EXPECT_EQ(lit->field.degree, degree);
        expect_seen(*lit, sample, [](const Vec3d& w) { return w; });
      }
    }
  }
}

TEST(CarriedRadiance, OfHarmonicsAlreadyReflectedIsKeptAsItIs) {
  const RadianceSample sample = radiance_triangle(RadianceBasis::harmonics, 3, true);
  const auto lit = import_lit(sample.glb());
  ASSERT_TRUE(lit) << lit.error().message;
  for (std::size_t v = 0; v < 3; ++v) {
    for (std::size_t i = 0; i < 48; ++i)  // turned there and back, rounded to float in between
      EXPECT_NEAR(lit->field.of(v)[i], sample.function[v].coefficients[i], 5e-7);
  }
}

TEST(CarriedRadiance, TurnsAndMirrorsWithItsNode) {
  const RadianceSample sample = radiance_triangle(RadianceBasis::harmonics, 4, false);
  // A third of a turn about (1, 1, 1): x becomes y, y becomes z, z becomes x.
  auto lit = import_lit(sample.glb(R"("rotation":[0.5,0.5,0.5,0.5],"scale":[2,2,2],"translation":[1,2,3])"));
  ASSERT_TRUE(lit) << lit.error().message;
  expect_seen(*lit, sample, [](const Vec3d& w) { return Vec3d{w.z, w.x, w.y}; });
  lit = import_lit(sample.glb(R"("scale":[-3,3,3])"));
  ASSERT_TRUE(lit) << lit.error().message;
  expect_seen(*lit, sample, [](const Vec3d& w) { return Vec3d{-w.x, w.y, w.z}; });
}

TEST(CarriedRadiance, OfAMeshThatStandsTwiceTurnsWithEachOfThem) {
  const RadianceSample sample = radiance_triangle(RadianceBasis::polynomials, 3, true);
  Sample file;
  const std::string primitive = sample.primitive(file);
  const auto lit = import_lit(file.glb(sample.declaration() + "\"meshes\":[{\"primitives\":[{" + primitive + R"(}]}],
    "nodes":[{"mesh":0},{"mesh":0,"rotation":[0.5,0.5,0.5,0.5],"translation":[9,0,0]}],"scenes":[{"nodes":[0,1]}])"));
  ASSERT_TRUE(lit) << lit.error().message;
  ASSERT_EQ(lit->field.vertices(), 6U);
  expect_seen(*lit, sample, [](const Vec3d& w) { return w; });
  expect_seen(
      *lit, sample,
      [](const Vec3d& w) {
        return Vec3d{w.z, w.x, w.y};
      },
      3);
}

TEST(CarriedRadiance, OfPolynomialsLiesAlongTheTangent) {
  // L = x^2 y^1 of a frame whose x is the tangent; the bitangent's side is w.
  for (const float side : {1.0F, -1.0F}) {
    RadianceSample sample = radiance_triangle(RadianceBasis::polynomials, 3, false);
    for (RadianceFunction& f : sample.function) {
      f.coefficients.assign(30, 0);
      f.coefficients[7] = 1;                                                       // k = 3, j = 1
      for (const float x : {0.0F, 2.0F, 0.3F, side}) sample.tangent.push_back(x);  // neither unit nor upright
    }
    const auto lit = import_lit(sample.glb());
    ASSERT_TRUE(lit) << lit.error().message;
    Random random(3, 4);
    for (std::uint32_t v = 0; v < 3; ++v) {
      const Vec3d n = sample.function[v].normal, along{0, 2, 0.3F};
      const Vec3d x = normalized(along - n * dot(n, along)), y = cross(n, x) * double{side};
      for (int eye = 0; eye < kEyes; ++eye) {
        const Vec3d view = testing::random_above(random, n);
        EXPECT_NEAR(seen_at(*lit, v, view).x, std::pow(dot(view, x), 2) * dot(view, y), kRounding);
        EXPECT_NEAR(seen_at(*lit, v, view).y, 0, kRounding);
      }
    }
  }
}

/// The file with `from` replaced by `to` of the same length in its JSON.
Bytes replaced(Bytes file, const std::string& from, const std::string& to) {
  const auto at = std::search(file.begin(), file.end(), from.begin(), from.end());
  EXPECT_TRUE(at != file.end() && from.size() == to.size()) << from;
  std::copy(to.begin(), to.end(), at);
  return file;
}

void expect_fault(const Bytes& file, const std::string& code, const std::string& place) {
  const auto lit = import_lit(file);
  ASSERT_FALSE(lit) << code;
  EXPECT_EQ(lit.error().code, code);
  EXPECT_NE(lit.error().where.find(place), std::string::npos) << lit.error().where;
}

TEST(CarriedRadiance, ThatIsIncompleteOrWrongNamesItsPlace) {
  const std::string primitive = "/meshes/0/primitives/0";
  const RadianceSample good = radiance_triangle(RadianceBasis::harmonics, 1, false);
  const Bytes file = good.glb();
  expect_fault(replaced(file, "\"_RF_2\"", "\"_XX_2\""), "radiance_incomplete", primitive + "/attributes/_RF_2");
  expect_fault(replaced(file, "\"degree\":1", "\"degree\":2"), "radiance_incomplete", primitive + "/attributes/_RF_4");
  expect_fault(replaced(file, "\"degree\":1", "\"degree\":0"), "radiance_count_mismatch", primitive + "/attributes");
  expect_fault(replaced(file, "\"degree\":1", "\"degree\":9"), "number_out_of_range",
               "/extensions/KILN_radiance_functions/degree");
  expect_fault(replaced(file, "\"version\":1", "\"version\":2"), "unsupported_version",
               "/extensions/KILN_radiance_functions/version");
  expect_fault(replaced(file, "\"degree\":1", "\"degre_\":1"), "property_missing",
               "/extensions/KILN_radiance_functions");
  expect_fault(replaced(file, "\"basis\":\"sh\"", "\"basis\":\"zh\""), "unknown_enum",
               "/extensions/KILN_radiance_functions/basis");
  RadianceSample no_normals = good;
  no_normals.normal.clear();
  expect_fault(no_normals.glb(), "radiance_without_normals", primitive);
  RadianceSample zero_normal = good;
  std::fill_n(zero_normal.normal.begin() + 3, 3, 0.0F);
  expect_fault(zero_normal.glb(), "radiance_without_normals", primitive + "/attributes/NORMAL element 1");
  RadianceSample not_a_number = good;
  not_a_number.function[2].coefficients[1] = std::numeric_limits<double>::quiet_NaN();
  expect_fault(not_a_number.glb(), "non_finite_geometry", primitive + "/attributes/_RF_1 element 2");
  RadianceSample far = good;
  far.function[1].coefficients[3] = 1e20;
  expect_fault(far.glb(), "number_out_of_range", primitive + "/attributes/_RF_3 element 1");
  RadianceSample short_column = good;
  short_column.function.pop_back();
  expect_fault(short_column.glb(), "attribute_count_mismatch", primitive + "/attributes/");
  RadianceSample no_tangent = radiance_triangle(RadianceBasis::polynomials, 1, false);
  no_tangent.tangent = {1, 0, 0, 1, 0, 0, 5, 1, 0, 1, 0, 1};  // the second stands on its normal
  expect_fault(no_tangent.glb(), "tangents_invalid", primitive + "/attributes/TANGENT element 1");
}

TEST(CarriedRadiance, MustBeFloatsOfThreeChannels) {
  Sample sample;
  const int position = sample.positions(test::kTriangle), normal = sample.normals({0, 0, 1, 0, 0, 1, 0, 0, 1}),
            bytes = sample.accessor(std::vector<std::uint8_t>(12), 5121, "VEC3", 3, ",\"normalized\":true", 4),
            grey = sample.accessor(std::vector<float>(3), 5126, "SCALAR", 3);
  const std::string declaration = radiance_triangle(RadianceBasis::harmonics, 0, false).declaration();
  for (const int wrong : {bytes, grey}) {
    const std::string members = "\"attributes\":{\"POSITION\":" + std::to_string(position) +
                                ",\"NORMAL\":" + std::to_string(normal) + ",\"_RF_0\":" + std::to_string(wrong) + "}";
    expect_fault(sample.glb(declaration + test::one_node(members)), "accessor_type", "/attributes/_RF_0");
  }
}

TEST(CarriedRadiance, OfSomePrimitivesAloneIsAFault) {
  const RadianceSample sample = radiance_triangle(RadianceBasis::harmonics, 1, false);
  Sample file;
  const std::string with = sample.primitive(file);
  const std::string without = "\"attributes\":{\"POSITION\":0,\"NORMAL\":1}";
  expect_fault(file.glb(sample.declaration() + test::one_node(with + "},{" + without)), "radiance_incomplete",
               "/meshes/0/primitives/1/attributes/_RF_0");
}

TEST(CarriedRadiance, UnderANodeThatStretchesIsAFault) {
  const RadianceSample sample = radiance_triangle(RadianceBasis::harmonics, 1, false);
  expect_fault(sample.glb(R"("scale":[1,2,1])"), "radiance_transform", "/nodes/0");
  expect_fault(sample.glb(R"("scale":[0,0,0])"), "radiance_transform", "/nodes/0");
}

TEST(CarriedRadiance, ThatNobodyAskedForOrDeclaredIsAWarning) {
  const Bytes file = radiance_triangle(RadianceBasis::harmonics, 1, false).glb();
  const auto plain = test::import_bytes(file);
  ASSERT_TRUE(plain) << plain.error().message;
  EXPECT_TRUE(has_warning(*plain, "radiance_not_used"));
  const auto undeclared = import_lit(replaced(file, "\"extensions\":{\"KILN", "\"extensionz\":{\"KILN"));
  ASSERT_TRUE(undeclared) << undeclared.error().message;
  EXPECT_TRUE(has_warning(undeclared->scene, "radiance_not_declared"));
  EXPECT_EQ(undeclared->field.vertices(), 0U);
}

}  // namespace
}  // namespace kiln
