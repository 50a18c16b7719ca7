// The step `lightfield`, from recipe to certificate.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/artifact/baked_scene.h"
#include "core/artifact/progressive_glb.h"
#include "core/bake/light_field_levels.h"
#include "core/lightfield/polynomial_space.h"
#include "core/lightfield/seen.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using testing::file;
using testing::input_of;
using testing::report_of;

BakeOutput baked(const std::string& scene, const std::string& recipe, int count = 0) {
  Threads threads(count);
  auto output = bake(input_of(scene, recipe), {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  return std::move(*output);
}

TEST(LightFieldBake, OfADiffuseRoomHoldsItsCertificateAndLevelsGetWorse) {
  const BakeOutput out = baked("room", R"({"steps":[{"do":"lightfield","degree":3,"rays":128,"lods":2,
    "subdivide":{"triangles":8000},"progressive":true}],"quality":"draft","environment":{"builtin":"overcast"}})");
  const nlohmann::json field = report_of(out)["lightfield"];
  ASSERT_EQ(field["levels"].size(), 3U);
  double before = 0;
  std::size_t triangles = 1'000'000;
  for (const auto& level : field["levels"]) {
    const double error = level["certificate"]["relrmse"], low = level["certificate"]["interval"][0];
    std::printf("%s %d triangles %.4f\n", level["file"].get<std::string>().c_str(), level["triangles"].get<int>(),
                error);
    EXPECT_GE(error, 0.9 * before);  // by other random points
    EXPECT_LE(level["triangles"].get<std::size_t>(), triangles);
    EXPECT_TRUE(level["triangles"].get<std::size_t>() < triangles || !level["reached"].get<bool>());
    EXPECT_GE(low, 0);
    before = error;
    triangles = level["triangles"];
    const auto decoded = read_baked_glb(file(out, level["file"]));
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->scene.mesh.triangles.size(), triangles);
    EXPECT_EQ(decoded->field.vertices(), decoded->scene.mesh.position.size());
  }
  EXPECT_LT(field["levels"][0]["certificate"]["relrmse"].get<double>(), 0.06);  // .024 measured
  const auto progressive = read_progressive(file(out, "scene.glb"));
  ASSERT_TRUE(progressive) << progressive.error().message;
  EXPECT_EQ(progressive->all.mesh.triangles.size(), field["levels"][0]["triangles"].get<std::size_t>());
}

TEST(LightFieldBake, WhatLooksTheSameFromEverywhereIsThatOfRadiosity) {
  // Roughness 1 and no metal: what the diffuse layer sends, and a faint wide lobe.
  const char* common = R"(,"subdivide":"off"}],"quality":"draft","environment":{"builtin":"uniform"}})";
  const BakeOutput field =
      baked("column", std::string(R"({"steps":[{"do":"lightfield","degree":2,"rays":128,"simplify":"off")") + common);
  const auto shown = read_baked_glb(file(field, "scene.glb"));
  ASSERT_TRUE(shown);
  double field_sum = 0, light_sum = 0;
  for (std::size_t i = 0; i < shown->scene.mesh.triangles.size(); ++i) {
    const Triangle& t = shown->scene.mesh.triangles[i];
    const Vec3d n = to_double(shown->scene.mesh.normal[t[0]]);
    field_sum += seen_radiance(shown->field, t, 0, 0, n, n).y;
    const Part& part = shown->scene.parts[shown->scene.mesh.part[i]];
    const double albedo = shown->scene.materials[static_cast<std::size_t>(part.material)].base_color.y;
    light_sum += albedo * double{shown->transfer.at(t[0], 0)[1]};
  }
  // The specular layer keeps .04 at this angle and sends back most of it.
  EXPECT_NEAR(field_sum / light_sum, 1, 0.08);
}

TEST(LightFieldBake, InPolynomialsIsEvenInTheHeightAboveTheSurface) {
  /// How much of the delivered coefficients no polynomial of the degree holds.
  const auto beyond = [](const std::string& basis) {
    const BakeOutput out = baked("column", R"({"steps":[{"do":"lightfield","degree":3,"rays":128,"subdivide":"off",
      "simplify":"off","basis":")" + basis + R"("}],"quality":"final","certificate":false,
      "environment":{"builtin":"clear"}})");
    EXPECT_EQ(report_of(out)["parameters"]["lightfield"]["basis"], basis);
    const auto shown = read_baked_glb(file(out, "scene.glb"));
    EXPECT_TRUE(shown);
    LightField folded = shown->field;
    Threads threads(1);
    keep_polynomials(folded, shown->scene.mesh.normal, threads);
    double all = 0, changed = 0;
    for (std::size_t i = 0; i < folded.coefficients.size(); ++i) {
      all += std::pow(double{folded.coefficients[i]}, 2);
      changed += std::pow(double{folded.coefficients[i] - shown->field.coefficients[i]}, 2);
    }
    return std::sqrt(changed / all);
  };
  const double of_series = beyond("sh"), of_polynomials = beyond("polynomial");
  std::printf("%.4f of the harmonics, %.4f of the polynomials\n", of_series, of_polynomials);
  EXPECT_LT(of_polynomials, 0.01);  // storage: .005 by area; here vertices count alike
  EXPECT_GT(of_series, 5 * of_polynomials);
}

TEST(LightFieldBake, ThreadCountChangesNotOneByteOfTheScene) {
  const char* recipe = R"({"steps":[{"do":"lightfield","degree":2,"rays":128,"lods":1,"subdivide":{"triangles":3000}}],
                           "quality":"draft","certificate":false,"environment":{"builtin":"clear"}})";
  const BakeOutput one = baked("room", recipe, 1), three = baked("room", recipe, 3);
  EXPECT_EQ(file(one, "scene.glb"), file(three, "scene.glb"));
  EXPECT_EQ(file(one, "lod1.glb"), file(three, "lod1.glb"));
}

TEST(LightFieldBake, ASeamThatOnlyRoundingHoldsOpenDoesNotTear) {
  // Two halves of a strip, whose common edge is 1e-9 apart.
  Mesh mesh;
  LightField field{.degree = 0, .coefficients = {}};
  for (std::uint32_t half = 0; half < 2; ++half) {
    for (std::uint32_t i = 0; i < 20; ++i) {
      for (std::uint32_t j = 0; j < 5; ++j) {
        const float x = half == 0 ? -0.1F * static_cast<float>(4 - j) : 0.1F * static_cast<float>(j) + 1e-9F;
        mesh.position.push_back({x, 0.02F * std::sin(static_cast<float>(i)), -0.4F + 0.04F * static_cast<float>(i)});
        mesh.normal.push_back({0, 1, 0});
        for (int c = 0; c < 3; ++c) field.coefficients.push_back(1 + 0.3F * std::sin(0.9F * static_cast<float>(i + c)));
        if (i == 0 || j == 0) continue;
        const std::uint32_t v = 100 * half + 5 * i + j;
        mesh.triangles.push_back({v - 6, v - 1, v - 5});
        mesh.triangles.push_back({v - 5, v - 1, v});
      }
    }
  }
  mesh.part.assign(mesh.triangles.size(), 0);
  Threads threads(1);
  BakeLog log({});
  log.begin("simplify", 1);
  const Transfer light{0, 3, true, std::vector<float>(3 * mesh.position.size(), 1.0F)};
  FieldPlan plan;
  plan.simplify.emplace(Simplify{.triangles = 60});
  const FieldLevels made = make_levels(mesh, light, field, plan, log, threads);
  const Mesh& out = made.levels.front().mesh;
  EXPECT_LE(out.triangles.size(), 60U);
  // Along the common edge both halves have the same places.
  std::set<float> sides[2];
  for (const Triangle& t : out.triangles) {
    float middle = 0;
    for (const std::uint32_t v : t) middle += out.position[v].x;
    for (const std::uint32_t v : t) {
      if (std::abs(out.position[v].x) < 1e-5F) sides[middle > 0].insert(out.position[v].z);
    }
  }
  EXPECT_EQ(sides[0], sides[1]);
  EXPECT_GE(sides[0].size(), 2U);
}

TEST(LightFieldBake, DarknessIsDarkAndHasNoError) {
  const BakeOutput out = baked("column", R"({"steps":[{"do":"lightfield","degree":2,"rays":128,"subdivide":"off"}],
                                             "quality":"draft"})");
  const nlohmann::json field = report_of(out)["lightfield"];
  EXPECT_EQ(field["certificate"]["relrmse"], 0.0);
  EXPECT_EQ(field["noise"], 0.0);
}

}  // namespace
}  // namespace kiln
