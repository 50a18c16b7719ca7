// points, eval, reference and a local bake by the built program, on scenes whose light is known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <tuple>

#include "client_cli/csv.h"
#include "client_cli/values.h"
#include "tests/client_cli/run_kiln.h"
#include "tests/core/artifact/gltf_samples.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr double kPi = std::numbers::pi;

class Light : public ::testing::Test {
 protected:
  Folder folder;
  std::string scene = folder.write("plane.gltf", plane_gltf(1, 8));

  std::string draw(const std::string& input, int count) {
    const Ran ran =
        run_kiln({"points", input, "--count", std::to_string(count), "--seed", "5", "-o", folder.path("p.csv")});
    EXPECT_EQ(ran.exit, 0) << ran.err;
    return folder.path("p.csv");
  }
  ValueTable values(std::vector<std::string> words) {
    words.insert(words.end(), {"-o", folder.path("v.csv")});
    const Ran ran = run_kiln(words);
    EXPECT_EQ(ran.exit, 0) << ran.err;
    const auto table = read_values(folder.path("v.csv"));
    return table ? *table : ValueTable{};
  }
};

TEST_F(Light, PointsLieOnTheSurfaceEvenlyAndRepeat) {
  const auto points = read_points(draw(scene, 400));
  ASSERT_TRUE(points);
  ASSERT_EQ(points->size(), 400U);
  double right = 0;
  for (const QueryPoint& point : *points) {
    EXPECT_NEAR(point.position.y, 0, 1e-6);  // a float step of the unit cube
    EXPECT_LE(std::abs(point.position.x), 1 + 1e-6);
    EXPECT_NEAR(point.normal.y, 1, 1e-6);
    right += point.position.x > 0;
  }
  EXPECT_NEAR(right / 400, 0.5, 0.1);  // 4 sigma of 400 coin tosses
  const std::string first = folder.read("p.csv");
  draw(scene, 400);
  EXPECT_EQ(folder.read("p.csv"), first);
}

TEST_F(Light, AViewDirectionMustBeADirection) {
  const std::string bad = folder.write("bad.csv", "0,0,0,0,1,0,0,0,0\n");
  const auto points = read_points(bad);
  ASSERT_FALSE(points);
  const auto good = read_points(folder.write("good.csv", "0,0,0,0,1,0,1,2,0\n"));
  ASSERT_TRUE(good && (*good)[0].view);
  EXPECT_EQ((*good)[0].view->y, 2);
  const auto none = read_points(folder.write("none.csv", "0,0,0,0,1,0\n"));
  ASSERT_TRUE(none);
  EXPECT_FALSE((*none)[0].view);
}

TEST_F(Light, APlaneUnderAConstantSkyOfOneReceivesPi) {
  const ValueTable truth =
      values({"reference", scene, "--points", draw(scene, 50), "--env", "1,1,1", "--samples", "64"});
  ASSERT_EQ(truth.values.size(), 50U);
  EXPECT_TRUE(truth.has_errors);
  for (const LightValue& value : truth.values) {
    EXPECT_NEAR(value.irradiance.x, kPi, 1e-5);  // cosine-distributed paths: exact up to float rounding
    EXPECT_NEAR(value.radiance.z, 1, 1e-5);
    EXPECT_NEAR(value.irradiance_error.y, 0, 1e-5);
  }
}

/// The plane in another finish.
std::string finished(const std::string& metallic, const std::string& roughness) {
  std::string text = plane_gltf(1, 8);
  const std::string key = R"("indices":2})", first = "{";
  text.replace(text.find(key), key.size(), R"("indices":2,"material":0})");
  return text.replace(0, 1,
                      R"({"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":)" +
                          metallic + R"(,"roughnessFactor":)" + roughness + "}}],");
}

TEST_F(Light, TowardsAnEyeTheReferenceShowsTheFresnelReflectionOfASmoothSurface) {
  // Under a constant sky of 1 a mirror of F0 shows F = F0 + (1 - F0) (1 - n.v)^5; what a dielectric transmits its
  // colour.
  const auto points = folder.write("p.csv", "x,y,z,nx,ny,nz,vx,vy,vz\n0.1,0,0.2,0,1,0,0,2,0\n0.1,0,0.2,0,1,0,4,3,0\n");
  const double slant = std::pow(0.4, 5);
  for (const auto& [metallic, f0, below] : {std::tuple{"1", 0.5, 0.0}, std::tuple{"0", 0.04, 0.5}}) {
    const ValueTable truth = values({"reference", folder.write("finished.gltf", finished(metallic, "0")), "--points",
                                     points, "--env", "1,1,1", "--samples", "256", "--albedo", "scene"});
    ASSERT_EQ(truth.values.size(), 2U);
    ASSERT_TRUE(truth.points[1].view);
    for (const std::size_t i : {0U, 1U}) {
      const double f = f0 + (1 - f0) * (i == 1 ? slant : 0);
      EXPECT_NEAR(truth.values[i].radiance.x, f + (1 - f) * below, 2e-3);  // roughness .03, and the table of lobes
      EXPECT_NEAR(truth.values[i].irradiance.x, kPi, 1e-5);
    }
  }
  const ValueTable white = values({"reference", folder.path("finished.gltf"), "--points", points, "--env", "1,1,1"});
  EXPECT_NEAR(white.values[1].radiance.x, 1, 1e-5) << "albedo one knows no eye";
}

TEST_F(Light, ABakedMetalShowsEyesWhatTheReferenceSays) {
  const std::string metal = folder.write("metal.gltf", finished("1", "0.6"));
  const std::string artefact = folder.path("out/scene.glb"), points = folder.path("p.csv");
  ASSERT_EQ(run_kiln({"bake", metal, "--env", "1,1,1", "--quality", "draft", "-o", folder.path("out")}).exit, 0);
  ASSERT_EQ(run_kiln({"points", artefact, "--count", "100", "--views", "--specular", "-o", points}).exit, 0);
  const auto drawn = read_points(points);
  ASSERT_TRUE(drawn && drawn->size() == 100U);
  for (const QueryPoint& p : *drawn) EXPECT_GE(dot(*p.view, p.normal), 0);
  const std::string a = folder.path("a.csv"), b = folder.path("b.csv");
  ASSERT_EQ(run_kiln({"eval", artefact, "--points", points, "--albedo", "scene", "-o", a}).exit, 0);
  ASSERT_EQ(run_kiln({"reference", metal, "--points", points, "--env", "1,1,1", "--samples", "512", "--albedo", "scene",
                      "-o", b})
                .exit,
            0);
  // Open to a constant sky: what is left is the table of lobes, .01 between its entries and .03 near grazing.
  EXPECT_EQ(run_kiln({"compare", a, b, "--column", "radiance", "--max-error", "0.02"}).exit, 0);
  EXPECT_EQ(run_kiln({"compare", artefact, b, "--column", "radiance", "--albedo", "scene", "--max-error", "0.02"}).exit,
            0);
  EXPECT_EQ(run_kiln({"compare", artefact, b, "--column", "radiance", "--max-error", "0.3"}).exit, 8)
      << "white is not the metal";
  EXPECT_EQ(run_kiln({"points", metal, "--specular"}).exit, 2) << "a scene has no matrices";
}

TEST_F(Light, ALightFieldThatMissesItsTargetIsDeliveredAndEndsWithEight) {
  const std::string metal = folder.write("metal.gltf", finished("1", "0.5"));
  const auto bake = [&](const std::string& quality) {
    const std::string recipe = folder.write(
        "recipe.json", R"({"environment":{"builtin":"overcast"},"quality":)" + quality +
                           R"(,"steps":[{"do":"lightfield","degree":2,"rays":64,"subdivide":"off","sky":"series"}]})");
    return run_kiln({"bake", metal, "-r", recipe, "-o", folder.path("out")});
  };
  const Ran missed = bake(R"({"target_error":0.001})");
  EXPECT_EQ(missed.exit, 8) << missed.err;
  EXPECT_NE(missed.err.find("/steps/0/"), std::string::npos) << "the knob that hinders: " << missed.err;
  EXPECT_NE(missed.out.find("scene.glb"), std::string::npos);
  EXPECT_EQ(run_kiln({"inspect", folder.path("out/scene.glb")}).exit, 0);
  const Ran met = bake(R"({"target_error":0.5})");
  EXPECT_EQ(met.exit, 0) << met.err;
}

TEST_F(Light, TheReferenceIsLinearInItsLight) {
  const ValueTable truth = values(
      {"reference", scene, "--points", draw(scene, 5), "--env", "0.5,1,4", "--intensity", "2", "--samples", "16"});
  for (const LightValue& value : truth.values) {
    EXPECT_NEAR(value.radiance.x, 1, 1e-5);
    EXPECT_NEAR(value.radiance.y, 2, 1e-5);
    EXPECT_NEAR(value.radiance.z, 8, 1e-4);
  }
}

TEST_F(Light, ABakedPlaneEvaluatesToThePathTracedTruth) {
  const Ran bake = run_kiln({"bake", scene, "--env", "1,1,1", "--quality", "draft", "-o", folder.path("out")});
  ASSERT_EQ(bake.exit, 0) << bake.err;
  EXPECT_NE(bake.out.find("scene.glb"), std::string::npos);
  EXPECT_NE(bake.err.find("100 %"), std::string::npos) << "one line per 10 %, no bar: stderr is no terminal";
  const std::string artefact = folder.path("out/scene.glb");
  const std::string points = draw(artefact, 60);
  const ValueTable own = values({"eval", artefact, "--points", points});
  ASSERT_EQ(own.values.size(), 60U);
  for (const LightValue& value : own.values) {
    // 12-bit coefficients over a range of about 1: half a step is 1.2e-4 for each of up to 36 of them.
    EXPECT_NEAR(value.irradiance.x, kPi, 0.01);
    EXPECT_NEAR(value.radiance.y, 1, 0.003);
    EXPECT_LT(value.distance, 1e-6);
  }
  const ValueTable blue = values({"eval", artefact, "--points", points, "--env", "0,0,2"});
  EXPECT_NEAR(blue.values[0].radiance.x, 0, 1e-6);
  EXPECT_NEAR(blue.values[0].radiance.z, 2, 0.006);
  ASSERT_EQ(run_kiln({"eval", artefact, "--points", points, "-o", folder.path("a.csv")}).exit, 0);
  ASSERT_EQ(run_kiln({"reference", scene, "--points", points, "--env", "1,1,1", "--samples", "64", "-o",
                      folder.path("b.csv")})
                .exit,
            0);
  EXPECT_EQ(run_kiln({"compare", folder.path("a.csv"), folder.path("b.csv"), "--max-error", "0.005"}).exit, 0);
  EXPECT_EQ(run_kiln({"compare", artefact, artefact, "--max-error", "0"}).exit, 0) << "an artefact is like itself";
  EXPECT_EQ(run_kiln({"compare", artefact, folder.path("b.csv"), "--max-error", "0.005"}).exit, 0);
  EXPECT_EQ(run_kiln({"eval", scene, "--points", points}).exit, 7) << "a scene is no artefact";
  const json facts = json::parse(run_kiln({"inspect", artefact, "--json"}).out);
  EXPECT_EQ(facts.at("kind"), "artefact");
  EXPECT_TRUE(facts.at("attributes").contains("_PRT_0"));
  EXPECT_TRUE(facts.at("certificate").is_object()) << "report.json stands beside it";
}

TEST_F(Light, APointThatFacesAwayHasNoValue) {
  const auto points = folder.write("p.csv", "0.1,0,0.2,0,1,0\n0.1,0,0.2,0,-1,0\n0.1,0.5,0.2,0,0,0\n");
  const Ran ran = run_kiln({"reference", scene, "--points", points, "--env", "1,1,1", "--samples", "16", "--json"});
  ASSERT_EQ(ran.exit, 0) << ran.err;
  const json rows = json::parse(ran.out);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_NEAR(rows[0].at("radiance_rgb")[0].get<double>(), 1, 1e-5);
  EXPECT_TRUE(rows[1].at("radiance_rgb").is_null());
  EXPECT_NEAR(rows[2].at("distance").get<double>(), 0.5, 1e-6);
  EXPECT_NE(ran.err.find("1 of 3 points"), std::string::npos);
}

TEST_F(Light, APlanSaysWhatAndWhyWithoutBaking) {
  const Ran text = run_kiln({"plan", scene});
  EXPECT_EQ(text.exit, 0) << text.err;
  EXPECT_NE(text.out.find("bounces"), std::string::npos);
  EXPECT_TRUE(json::parse(run_kiln({"plan", scene, "--json"}).out).at("plan").is_array());
}

TEST_F(Light, CtrlCStopsALocalBakeWithOneHundredAndThirty) {
  const auto big = folder.path("column.glb");
  ASSERT_EQ(run_kiln({"demo-scene", "column", "-o", big}).exit, 0);
  const auto recipe = folder.write("slow.json", R"({"steps":[{"do":"prt","order":10,"samples":65536,"bounces":8}],)"
                                                R"("environment":{"builtin":"clear"}})");
  const Ran ran = run_until({"bake", big, "-r", recipe, "-o", folder.path("never")}, "0 %");
  EXPECT_EQ(ran.exit, 130) << ran.err;
}

TEST_F(Light, AGridIsAskedAsAnArtefactIsAndAgreesWithTheReflectedLightOfTheReference) {
  // Of the demo's room, whose certificate says how far they may be apart.
  const std::string room = folder.path("room.glb");
  ASSERT_EQ(run_kiln({"demo-scene", "room", "-o", room}).exit, 0);
  const std::string recipe =
      folder.write("r.json", R"({"steps":[{"do":"grid","resolution":[10,10,10],"samples":256}],"quality":"draft"})");
  const Ran baked = run_kiln({"bake", room, "-r", recipe, "-o", folder.path("out")});
  ASSERT_EQ(baked.exit, 0) << baked.err;
  EXPECT_NE(baked.err.find("of the grid"), std::string::npos);
  const std::string points = draw(room, 300), grid = folder.path("out/grid.exr");
  const ValueTable stored = values({"eval", grid, "--points", points});
  const ValueTable truth = values({"reference", room, "--points", points, "--indirect", "--samples", "256"});
  ASSERT_EQ(stored.values.size(), 300U);
  double apart = 0, mean = 0, seen = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    const double light = truth.values[i].irradiance.y;
    if (light == 0) continue;  // floor inside a box, which the certificate does not judge
    apart += std::pow(stored.values[i].irradiance.y - light, 2);
    mean += light;
    ++seen;
  }
  ASSERT_GT(seen, 250);
  apart /= seen, mean /= seen;
  const json report = json::parse(folder.read("out/report.json"));
  const double certified = report["grid"]["certificate"]["interval"][1];
  EXPECT_LT(std::sqrt(apart) / mean, 1.5 * certified + 0.05);  // other points, one channel, and the reference's noise
  EXPECT_EQ(run_kiln({"eval", grid, "--points", points, "--env", "1,1,1"}).exit, 2);
  const json facts = json::parse(run_kiln({"inspect", grid, "--json"}).out);
  EXPECT_EQ(facts["kind"], "grid");
  EXPECT_EQ(facts["grid"]["size"], (std::vector<int>{10, 10, 10}));
}

/// A black floor of four vertices under a lid, and a layout for a lightmap.
std::string floor_and_lid() {
  test::Sample s;
  s.positions({-2, 0, 2, 2, 0, 2, 2, 0, -2, -2, 0, -2, -.5F, .4F, .5F, .5F, .4F, .5F, .5F, .4F, -.5F, -.5F, .4F, -.5F});
  const std::vector<float> uv{.02F, .98F, .6F, .98F, .6F, .4F, .02F, .4F, .7F, .2F, .85F, .2F, .85F, .05F, .7F, .05F};
  s.accessor(uv, 5126, "VEC2", 8);
  s.indices({0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7});
  const Bytes glb =
      s.glb(test::one_node("\"attributes\":{\"POSITION\":0,\"TEXCOORD_1\":1},\"indices\":2,\"material\":0") +
            ",\"materials\":[{\"doubleSided\":true,\"pbrMetallicRoughness\":{\"baseColorFactor\":[0,0,0,1]}}]");
  return {glb.begin(), glb.end()};
}

TEST_F(Light, ALightmapIsAskedApartFromTheVerticesBesideIt) {
  const std::string model = folder.write("lid.glb", floor_and_lid()), artefact = folder.path("out/scene.glb");
  const std::string recipe = folder.write(
      "r.json", R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":128}}],"quality":"draft",)"
                R"("environment":{"constant":[1,1,1]}})");
  const Ran baked = run_kiln({"bake", model, "-r", recipe, "-o", folder.path("out")});
  ASSERT_EQ(baked.exit, 0) << baked.err;
  const std::string points = folder.write("q.csv", "x,y,z,nx,ny,nz\n0,0,0,0,1,0\n1.8,0,1.8,0,1,0\n");
  const ValueTable truth = values({"reference", model, "--points", points, "--env", "1,1,1", "--samples", "4096"});
  const ValueTable map = values({"eval", artefact, "--points", points, "--lightmap"});
  const ValueTable vertices = values({"eval", artefact, "--points", points});
  ASSERT_EQ(truth.values.size(), 2U);
  ASSERT_LT(truth.values[0].irradiance.y, 0.7 * kPi);
  for (const std::size_t i : {0U, 1U})  // a step of its 8 bits, noise of 128 rays a texel: 5 % together
    EXPECT_NEAR(map.values[i].irradiance.y, truth.values[i].irradiance.y, 0.05 * kPi);
  EXPECT_GT(vertices.values[0].irradiance.y, truth.values[0].irradiance.y + 0.1 * kPi) << "four corners see no lid";
  EXPECT_EQ(run_kiln({"eval", artefact, "--points", points, "--lightmap", "--env", "1,1,1"}).exit, 2);
  ASSERT_EQ(run_kiln({"bake", scene, "--quality", "draft", "-o", folder.path("plain")}).exit, 0);
  EXPECT_EQ(run_kiln({"eval", folder.path("plain/scene.glb"), "--points", points, "--lightmap"}).exit, 2);
}

TEST_F(Light, ALampThatMovesIsAskedOfLinksAndAgreesWithTheReference) {
  const std::string room = folder.path("room.glb");
  ASSERT_EQ(run_kiln({"demo-scene", "room", "-o", room}).exit, 0);
  const std::string recipe = folder.write(
      "r.json", R"({"steps":[{"do":"transport","rays":256,"subdivide":{"triangles":6000}}],"quality":"draft"})");
  const Ran baked = run_kiln({"bake", room, "-r", recipe, "-o", folder.path("out")});
  ASSERT_EQ(baked.exit, 0) << baked.err;
  const std::string points = draw(room, 300), scene = folder.path("out/scene.glb");
  const json lamps = json::parse(folder.read("out/report.json"))["links"]["certificate"]["lamps"];
  const json at = lamps[0]["place"];
  const std::string lamp = "--light=" + at[0].dump() + "," + at[1].dump() + "," + at[2].dump() + ",4,2,1";
  for (const bool indirect : {true, false}) {
    std::vector<std::string> ask{"eval", scene, "--points", points, lamp};
    std::vector<std::string> truth_of{"reference", room, "--points", points, lamp, "--samples", "256"};
    if (indirect) ask.push_back("--indirect"), truth_of.push_back("--indirect");
    const ValueTable stored = values(ask), truth = values(truth_of);
    ASSERT_EQ(stored.values.size(), 300U);
    double apart = 0, mean = 0;
    for (std::size_t i = 0; i < 300; ++i) {
      apart += std::abs(stored.values[i].irradiance.x - truth.values[i].irradiance.x) / 300;
      mean += truth.values[i].irradiance.x / 300;
    }
    std::printf("mean distance %.4f of the mean\n", apart / mean);
    EXPECT_GT(mean, 0);
    EXPECT_LT(apart / mean, 0.15);  // the reference's own noise of 256 paths, and links at draft
  }
  EXPECT_EQ(run_kiln({"eval", scene, "--points", points, "--light", "1,2"}).exit, 2);
  EXPECT_EQ(run_kiln({"eval", scene, "--points", points, "--light", "1,2,nan"}).exit, 2);
  EXPECT_EQ(run_kiln({"eval", scene, "--points", points, "--light", "1,2,3,-1,0,0"}).exit, 2);
  EXPECT_EQ(run_kiln({"eval", scene, "--points", points, "--indirect"}).exit, 2);
}

}  // namespace
}  // namespace kiln
