// The step `lightfield`, from recipe to certificate.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/artifact/baked_scene.h"
#include "core/artifact/progressive_glb.h"
#include "core/bake/field_eye.h"
#include "core/bake/kept_apart.h"
#include "core/bake/light_field_levels.h"
#include "core/lightfield/polynomial_space.h"
#include "core/prt/lobe_table.h"
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
    EXPECT_EQ(level["screen_pixels"].is_null(), level["file"] == "scene.glb");
    const bool seen = level["screen_pixels"].is_null() || level["screen_pixels"] == 0;
    EXPECT_TRUE(seen || level["screen_difference"] <= 2.3);
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
  const FieldEye eye(*shown);
  for (std::uint32_t i = 0; i < shown->scene.mesh.triangles.size(); ++i) {
    const Triangle& t = shown->scene.mesh.triangles[i];
    const Vec3d n = to_double(shown->scene.mesh.normal[t[0]]);
    field_sum += eye.seen({i, 0, 0, 0}, n, n).y;
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
  const FieldLevels made = make_levels(mesh, light, field, plan, {}, log, threads);
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

Scene metal_face(float roughness) {
  Scene scene;
  scene.mesh.position = {{0, 0, 0}, {0.1F, 0, 0}, {0, 0.1F, 0}};
  scene.mesh.normal.assign(3, {0, 0, 1});
  scene.mesh.triangles = {{0, 1, 2}};
  scene.mesh.part = {0};
  scene.parts = {{.name = "face"}};
  scene.materials = {{.name = "metal", .metallic = 1, .roughness = roughness}};
  return scene;
}

/// What the plan says of the sky.
nlohmann::json decision_of(const BakeOutput& out) {
  const nlohmann::json report = report_of(out);
  for (const auto& decision : report["plan"])
    if (decision["decision"] == "sky") return decision;
  return {};
}

TEST(LightFieldSky, IsApartOnlyWhereSomethingMirrorsItTooSharply) {
  const Scene rough = metal_face(0.9F), smooth = metal_face(0.2F);
  const Environment sun = clear_sky_with_sun(), even = constant_sky({1, 1, 1});
  const auto choose = [](const Scene& scene, const Environment* sky, SkyPart asked = SkyPart::automatic) {
    return decide_sky(scene, sky, 4, 0.02, asked);
  };
  EXPECT_TRUE(choose(smooth, &sun).apart) << choose(smooth, &sun).reason;
  EXPECT_FALSE(choose(smooth, &even).apart);
  EXPECT_FALSE(choose(smooth, nullptr).apart);
  EXPECT_FALSE(choose(rough, &sun).apart);
  EXPECT_TRUE(choose(smooth, &even, SkyPart::apart).apart);
  EXPECT_FALSE(choose(rough, &sun, SkyPart::apart).apart);  // nothing would be kept
  EXPECT_FALSE(choose(smooth, &sun, SkyPart::series).apart);
  EXPECT_FALSE(decide_sky(smooth, &sun, 1, 0.02, SkyPart::automatic).apart);
  EXPECT_NE(choose(rough, &sun).reason.find("roughness 0.9"), std::string::npos) << choose(rough, &sun).reason;
}

TEST(LightFieldEmitters, AreNamedWhereSmoothSurfacesMirrorThem) {
  const auto glowing = [](float roughness) {
    Scene scene = metal_face(roughness);
    scene.materials[0].emission = {0, 0, 2};
    return scene;
  };
  EXPECT_FALSE(softened_emitters(metal_face(0.2F), 6));
  EXPECT_FALSE(softened_emitters(glowing(0.9F), 6));
  const auto said = softened_emitters(glowing(0.2F), 6);
  ASSERT_TRUE(said);
  EXPECT_NE(said->find("roughness 0.2"), std::string::npos) << *said;
  EXPECT_NE(said->find("7 bands"), std::string::npos) << *said;
}

/// Of four texels across the face the first two glow.
Scene glowing_texture() {
  Scene scene = metal_face(0.9F);
  scene.images = {{.name = "glow", .mime = "image/png", .encoded = {}, .width = 4, .height = 1, .rgba = {}}};
  scene.images[0].rgba = {255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255};
  scene.textures = {{.image = 0, .nearest = true}};
  scene.mesh.uv0 = {{0, 0}, {1, 0}, {0, 1}};
  scene.materials[0].emission = {3, 2, 1};
  return scene;
}

TEST(LightFieldEmission, OfTexturesIsApartAndAsSharpAsTheyAre) {
  Scene scene = glowing_texture();
  EXPECT_FALSE(decide_emission(scene).apart);  // all of it glows
  scene.materials[0].emission_texture.texture = 0;
  EXPECT_TRUE(decide_emission(scene).apart);
  LightField field{.degree = 0, .coefficients = std::vector<float>(9, 0.5F)};
  const auto seen = [&](double u) { return FieldEye(scene, field, {}).seen({0, u, 0, 0}, {0, 0, 1}, {0, 0, 1}); };
  const Vec3d before = seen(0.45);
  EXPECT_NEAR(before.x, seen(0.55).x, 1e-12);  // weights sum to 1 within rounding
  field.emission_apart = true;
  EXPECT_NEAR(length(seen(0.45) - before - Vec3d{3, 2, 1}), 0, 1e-6);  // floats of materials
  EXPECT_NEAR(length(seen(0.55) - before), 0, 1e-6);
}

/// Of four texels across the face the first two are white, the others black.
TEST(LightFieldDiffuse, UnderTexturesIsApartAndAsSharpAsTheyAre) {
  Scene scene = glowing_texture();
  scene.materials[0].emission = {};
  scene.materials[0].metallic = 0.5F;
  EXPECT_FALSE(decide_diffuse(scene).apart);
  scene.materials[0].base_color_texture.texture = 0;
  EXPECT_TRUE(decide_diffuse(scene).apart);
  scene.materials[0].metallic = 1;
  EXPECT_FALSE(decide_diffuse(scene).apart);  // nothing is diffuse
  scene.materials[0].metallic = 0;
  LightField field{.degree = 0, .coefficients = std::vector<float>(9, 0.5F)};
  const auto seen = [&](double u) { return FieldEye(scene, field, {}).seen({0, u, 0, 0}, {0, 0, 1}, {0, 0, 1}); };
  const Vec3d before = seen(0.45);
  field.diffuse = {1, 2, 3, 1, 2, 3, 1, 2, 3};
  scene.materials[0].base_color = {0.5F, 0.25F, 0.75F, 1};
  const Vec3d base{0.5, 0.25, 0.75};
  const double left = 1 - lobe_at(albedo_table(), 1, double{scene.materials[0].roughness}).kept();
  EXPECT_NEAR(length(seen(0.45) - before - base * Vec3d{1, 2, 3} * left), 0, 1e-6);  // floats of materials
  EXPECT_NEAR(length(seen(0.55) - before), 0, 1e-6);
}

/// Bands 0 and 1 hold a sky that is a constant and a slope; a small lamp they do not.
TEST(LightFieldSky, WhatBandsLeaveOut) {
  const auto sky = [](auto&& radiance) { return averaged_sky(64, 2, radiance); };
  EXPECT_LT(left_by_bands(sky([](const Vec3f& w) {
                            return Vec3f{1, 1, 1} * (1 + 0.5F * w.y);
                          }),
                          1),
            0.01);  // .007: texels of 2.8 degrees are even inside, the projection is of a map that is not
  const Environment lamp = sky([](const Vec3f& w) { return Vec3f{1, 1, 1} * (w.y > 0.95F ? 100.0F : 0.1F); });
  EXPECT_GT(left_by_bands(lamp, 4), 1);
  EXPECT_GT(left_by_bands(lamp, 2), left_by_bands(lamp, 8));
}

/// The skip against the whole: where the plan leaves the sky in the series, keeping it apart would change nothing.
TEST(LightFieldSky, UnderAnEvenSkyBothSayTheSame) {
  const auto bake_with = [](const std::string& sky) {
    Threads threads(2);
    const std::string recipe = R"({"steps":[{"do":"lightfield","degree":4,"rays":512,"subdivide":"off","simplify":"off",
      "sky":")" + sky + R"("}],"quality":"draft","environment":{"builtin":"uniform"}})";
    auto output =
        bake(testing::finished("column", recipe, {{"knot", {{"metallicFactor", 1}, {"roughnessFactor", 0.3}}}}), {},
             threads);
    EXPECT_TRUE(output) << output.error().message;
    return std::move(*output);
  };
  const BakeOutput skipped = bake_with("auto"), forced = bake_with("apart");
  EXPECT_EQ(decision_of(skipped)["value"], "in the series");
  EXPECT_EQ(decision_of(forced)["value"], "apart");
  const double a = report_of(skipped)["lightfield"]["levels"][0]["certificate"]["relrmse"];
  const double b = report_of(forced)["lightfield"]["levels"][0]["certificate"]["relrmse"];
  std::printf("in the series %.4f, apart %.4f\n", a, b);
  EXPECT_NEAR(a, b, 0.02);
}

}  // namespace
}  // namespace kiln
