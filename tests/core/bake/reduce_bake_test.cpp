// The step `reduce` as users meet it.
#include <gtest/gtest.h>

#include <cmath>

#include "core/artifact/baked_scene.h"
#include "core/artifact/image_decode.h"
#include "core/base/sha256.h"
#include "tests/core/bake/bake_input.h"
#include "tests/core/reduce/models.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;
using testing::input_of;
using testing::report_of;

/// A ball of 19,200 triangles with bumps.
BakeInput ball(const std::string& recipe) {
  testing::Model model = testing::sphere(40);
  for (Vec3d& p : model.position) p = p * (1 + 0.02 * std::sin(25 * p.x) * std::sin(25 * p.y) * std::sin(25 * p.z));
  BakeInput input;
  input.scene = {.name = "ball.ply", .main = testing::binary_ply(model), .resources = {}};
  input.recipe = *parse_recipe(recipe);
  return input;
}

Result<BakeOutput> bake_once(const BakeInput& input, int count = 2) {
  Threads threads(count);
  return bake(input, {}, threads);
}

std::string refused_as(const BakeInput& input) {
  const auto output = bake_once(input);
  return output ? "" : output.error().code;
}

TEST(ReduceStep, MakesAPlainSceneWithANormalMapAndAReport) {
  const BakeInput input = ball(R"({"steps":[{"do":"reduce","triangles":2000}]})");
  const auto output = bake_once(input);
  ASSERT_TRUE(output) << output.error().message;
  ASSERT_EQ(output->files.size(), 4U);
  EXPECT_EQ(output->files[0].name, "scene.glb");
  const auto scene = import_scene({.name = "scene.glb", .main = file(*output, "scene.glb"), .resources = {}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(scene->warnings.empty());
  EXPECT_LE(scene->mesh.triangles.size(), 2000U);
  EXPECT_GT(scene->mesh.triangles.size(), 1900U);
  EXPECT_GE(scene->materials[0].normal_texture.texture, 0);
  EXPECT_EQ(scene->mesh.tangent.size(), scene->mesh.position.size());
  const auto before = import_scene(input.scene);
  EXPECT_NEAR(scene->frame.scale, before->frame.scale, 0.01 * before->frame.scale);
  EXPECT_LT(length(scene->frame.center - before->frame.center), 0.01 * before->frame.scale);

  const json report = report_of(*output);
  EXPECT_EQ(report["result"]["triangles"], scene->mesh.triangles.size());
  EXPECT_EQ(report["scene"]["triangles"], before->mesh.triangles.size());
  EXPECT_LT(report["reduce"]["error"]["rms"].get<double>(), 0.003);
  EXPECT_GT(report["reduce"]["error"]["rms"].get<double>(), 0);
  EXPECT_LT(report["reduce"]["normal_degrees_rms"].get<double>(), 5);  // issue 5
  EXPECT_LT(report["reduce"]["normal_degrees_rms"], report["reduce"]["normal_degrees_rms_without_map"]);
  EXPECT_GT(report["reduce"]["own_memory_bytes"], 0);
  EXPECT_FALSE(report["reduce"]["unchanged"]);
}

TEST(ReduceStep, GivesTheSameBytesForAnyNumberOfThreads) {
  const BakeInput input = ball(R"({"steps":[{"do":"reduce","ratio":0.02,"normal_map":256}]})");
  const auto one = bake_once(input, 1), three = bake_once(input, 3);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(file(*one, "scene.glb"), file(*three, "scene.glb"));
  EXPECT_EQ(file(*one, "preview.png"), file(*three, "preview.png"));
}

/// The pixel in the middle of preview.png.
std::array<int, 3> middle_of(const BakeOutput& output) {
  const Bytes& png = file(output, "preview.png");
  const auto header = read_image_header(png);
  const auto pixels = decode_image(png, *header);
  const std::size_t at = 4 * (header->height / 2 * header->width + header->width / 2);
  return {(*pixels)[at], (*pixels)[at + 1], (*pixels)[at + 2]};
}

TEST(ReduceStep, StoresNormalsInSixteenBitsWhereItIsAsked) {
  constexpr const char* kRecipe = R"({"steps":[{"do":"reduce","triangles":2000,"normal_map":256,"normal_bits":)";
  const auto normals = [](const BakeOutput& output) {
    return import_scene({.name = "scene.glb", .main = file(output, "scene.glb"), .resources = {}})->images.at(0);
  };
  const auto plain = bake_once(ball(std::string(kRecipe) + "8}]}")),
             deep = bake_once(ball(std::string(kRecipe) + "16}]}"));
  ASSERT_TRUE(plain && deep);
  const Image eight = normals(*plain), sixteen = normals(*deep);
  EXPECT_EQ(eight.encoded.at(24), 8);  // the depth in a PNG's header
  EXPECT_EQ(sixteen.encoded.at(24), 16);
  const auto few = decode_image(eight.encoded, *read_image_header(eight.encoded)),
             many = decode_image(sixteen.encoded, *read_image_header(sixteen.encoded));
  ASSERT_TRUE(few && many && few->size() == many->size());
  for (std::size_t i = 0; i < few->size(); ++i) ASSERT_NEAR((*few)[i], (*many)[i], 1) << i;  // rounded once and twice
  EXPECT_LT(report_of(*deep)["reduce"]["normal_degrees_rms"], report_of(*plain)["reduce"]["normal_degrees_rms"]);
}

TEST(ReduceStep, ShowsAConvexModelUnderAnEvenSkyEvenly) {
  BakeInput input;
  input.scene = {.name = "ball.ply", .main = testing::binary_ply(testing::sphere(40)), .resources = {}};
  input.recipe = *parse_recipe(R"({"steps":[{"do":"reduce","triangles":100000}],"environment":{"builtin":"uniform"}})");
  const auto output = bake_once(input);
  ASSERT_TRUE(output);
  // Nothing shades anything: all of it is the 90th percentile, which displays as 0.8, 231 in sRGB. Vertex normals that
  // lean over their faces lose some of 64 paths.
  for (const int c : middle_of(*output)) EXPECT_NEAR(c, 231, 3);
}

TEST(ReduceStep, ShowsTheModelUnderTheLightOfTheJob) {
  const auto output =
      bake_once(ball(R"({"steps":[{"do":"reduce","triangles":2000}],"environment":{"constant":[0.2,0.4,0.8]}})"));
  ASSERT_TRUE(output);
  const auto [r, g, b] = middle_of(*output);
  EXPECT_LT(r, g - 20);
  EXPECT_LT(g, b - 20);
  EXPECT_EQ(report_of(*output)["warnings"][0]["code"], "environment_unused");
}

TEST(ReduceStep, LeavesThePictureOutWhereItDoesNotFitIntoMemory) {
  BakeInput input;
  input.scene = {.name = "ball.ply", .main = testing::binary_ply(testing::sphere(100)), .resources = {}};
  input.recipe = *parse_recipe(R"({"steps":[{"do":"reduce","triangles":200000}],"limits":{"memory_mb":110}})");
  const auto output = bake_once(input);
  ASSERT_TRUE(output) << output.error().message;
  for (const ArtifactFile& f : output->files) EXPECT_NE(f.name, "preview.png");
  const json plan = report_of(*output)["plan"];
  EXPECT_EQ(plan.back()["decision"], "preview");
  EXPECT_EQ(plan.back()["value"], "none");
}

TEST(ReduceStep, ReturnsASmallModelUnchangedWithANote) {
  const BakeInput input = input_of("room", R"({"steps":[{"do":"reduce","triangles":1000000}]})");
  const auto output = bake_once(input);
  ASSERT_TRUE(output);
  const std::span<const std::uint8_t> main = input.scene.main;
  EXPECT_EQ(file(*output, "scene.glb"), Bytes(main.begin(), main.end()));
  const json report = report_of(*output);
  EXPECT_TRUE(report["reduce"]["unchanged"]);
  EXPECT_EQ(report["plan"][1]["decision"], "reduction");
  EXPECT_EQ(report["plan"][1]["value"], "none");
}

TEST(ReduceStep, ReturnsASmallPlyAsAGlbOfTheSameTriangles) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n"
      "property list uchar int vertex_indices\nend_header\n"
      "0 0 0 255 0 0\n2 0 0 255 0 0\n2 2 0 255 0 0\n0 2 1 255 0 0\n3 0 1 2\n3 0 2 3\n";
  BakeInput input;
  input.scene = {.name = "scan.ply", .main = Bytes(ply.begin(), ply.end()), .resources = {}};
  input.recipe = *parse_recipe(R"({"steps":[{"do":"reduce","triangles":4}]})");
  input.spill_folder = "/tmp";
  const auto output = bake_once(input);
  ASSERT_TRUE(output) << output.error().message;
  const auto scene = import_scene({.name = "scene.glb", .main = file(*output, "scene.glb"), .resources = {}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->mesh.triangles.size(), 2U);
  for (const Vec4f& c : scene->mesh.color) EXPECT_EQ(c, (Vec4f{1, 0, 0, 1}));
  EXPECT_EQ(scene->frame.scale, 2);
}

TEST(ReduceStep, IsPlannedFromTheHeader) {
  Threads threads(1);
  BakeInput input = ball(R"({"steps":[{"do":"reduce","triangles":1000,"normal_map":"off"}]})");
  const auto text = plan_json(input, threads);
  ASSERT_TRUE(text) << text.error().message;
  const json plan = json::parse(*text);
  EXPECT_EQ(plan["prediction"]["triangles"], 1000);
  EXPECT_GT(plan["prediction"]["seconds"], 0);
  EXPECT_GT(plan["prediction"]["memory_bytes"], 1 << 20);
  EXPECT_EQ(plan["parameters"]["normal_map"], 0);
  EXPECT_EQ(plan["plan"][0]["value"], "1000");
}

TEST(ReduceStep, SaysWhatDoesNotFitBeforeItStarts) {
  EXPECT_EQ(refused_as(ball(R"({"limits":{"memory_mb":64},"steps":[{"do":"reduce","triangles":9000}]})")),
            "memory_limit");
  EXPECT_EQ(refused_as(ball(R"({"steps":[{"do":"reduce"}],"strict":true,"environment":{"builtin":"clear"}})")),
            "strict_environment_unused");
}

TEST(ReduceStep, GoesOnWithLightWhereTheRecipeDoes) {
  const BakeInput input = ball(
      R"({"environment":{"builtin":"uniform"},"quality":"draft",
          "steps":[{"do":"reduce","triangles":1000},{"do":"prt","order":2,"samples":64,"subdivide":"off"}]})");
  const auto output = bake_once(input);
  ASSERT_TRUE(output) << output.error().message;
  const json report = report_of(*output);
  EXPECT_LE(report["scene"]["triangles"], 1000);
  EXPECT_EQ(report["reduce"]["input"]["triangles"], 19200);
  EXPECT_GT(report["reduce"]["error"]["rms"], 0);
  EXPECT_EQ(report["recipe"]["steps"].size(), 2U);
  EXPECT_TRUE(report["certificate"].is_object());
  EXPECT_EQ(report["stages"][1]["name"], "measure");
  const auto baked = read_baked_glb(file(*output, "scene.glb"));
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(json::parse(baked->provenance)["scene_sha256"], sha256_hex(input.scene.main));
}

TEST(ReduceStep, IsCancelledLikeAnyOther) {
  Threads threads(2);
  threads.stop();
  EXPECT_THROW(static_cast<void>(bake(ball(R"({"steps":[{"do":"reduce"}]})"), {}, threads)), Cancelled);
}

TEST(ReduceStep, TellsItsProgressWithoutFallingBack) {
  double last = 0;
  std::vector<std::string> stages;
  Threads threads(2);
  const auto output = bake(
      ball(R"({"steps":[{"do":"reduce","triangles":2000}]})"),
      [&](const ProgressEvent& event) {
        EXPECT_GE(event.fraction, last);
        last = event.fraction;
        if (stages.empty() || stages.back() != event.stage) stages.push_back(event.stage);
      },
      threads);
  ASSERT_TRUE(output);
  EXPECT_EQ(stages, (std::vector<std::string>{"read", "measure", "collect", "collapse", "atlas", "project", "maps",
                                              "write", "preview"}));
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace kiln
