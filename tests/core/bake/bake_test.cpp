// Whole bakes of the bundled scenes, small enough for a unit test.
#include "core/bake/bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using testing::file;
using testing::input_of;
using testing::report_of;

BakeInput column_input(const std::string& recipe) { return input_of("column", recipe); }

constexpr const char* kSmall =
    R"({"environment":{"builtin":"clear"},"steps":[{"do":"prt","order":4,"samples":256,"bounces":2,"subdivide":{"triangles":6000}}]})";

TEST(Bake, GivesTheFourArtefactsAndACertificateThatIsSmallOnAnEasyScene) {
  Threads threads;
  const auto output = bake(column_input(kSmall), {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  std::vector<std::string> names;
  for (const ArtifactFile& f : output->files) names.push_back(f.name);
  EXPECT_EQ(names, (std::vector<std::string>{"scene.glb", "preview.png", "report.json", "log.txt"}));
  const auto certificate = report_of(*output)["certificate"];
  // 256 stratified rays leave about 7 % noise on a transfer vector (anchors.md), less on its product with light.
  EXPECT_LT(certificate["relrmse"].get<double>(), 0.08);
  EXPECT_GT(certificate["relrmse"].get<double>(), 0.0);
  EXPECT_GE(certificate["points"].get<int>(), 1000);  // of 1024: nearly all find their place on the input
}

TEST(Bake, ThreadCountChangesNotOneByteOfTheScene) {
  // The room has a lamp, whose weight in the split measure must not hang on how points are cut into batches.
  for (const char* scene : {"column", "room"}) {
    Threads one(1), three(3);
    const auto a = bake(input_of(scene, kSmall), {}, one);
    const auto b = bake(input_of(scene, kSmall), {}, three);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(file(*a, "scene.glb"), file(*b, "scene.glb")) << scene;
    EXPECT_EQ(file(*a, "preview.png"), file(*b, "preview.png")) << scene;
  }
}

TEST(Bake, TriangleBudgetIsNeverExceeded) {
  Threads threads;
  const auto output = bake(column_input(kSmall), {}, threads);
  ASSERT_TRUE(output);
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  ASSERT_TRUE(decoded);
  EXPECT_LE(decoded->scene.mesh.triangles.size(), 6000U);
}

TEST(Bake, ProgressNeverFallsAndEndsWhole) {
  Threads threads;
  double last = 0;
  const auto output = bake(
      column_input(kSmall),
      [&](const ProgressEvent& e) {
        EXPECT_GE(e.fraction, last);
        last = e.fraction;
      },
      threads);
  ASSERT_TRUE(output);
  EXPECT_DOUBLE_EQ(last, 1.0);
}

TEST(Bake, MoreMemoryThanAllowedIsRefusedBeforeWorkWithBothNumbers) {
  Threads threads;
  const auto output = bake(column_input(R"({"limits":{"memory_mb":64}})"), {}, threads);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, "memory_limit");
  EXPECT_NE(output.error().message.find("64 MB"), std::string::npos);
}

TEST(Bake, AStoppedBakeThrowsCancelled) {
  Threads threads;
  threads.stop();
  EXPECT_THROW((void)bake(column_input(kSmall), {}, threads), Cancelled);
}

TEST(Bake, ClosedRoomLitByItsLampAgreesWithThePathTracer) {
  Threads threads;
  BakeInput input =
      column_input(R"({"steps":[{"do":"prt","order":1,"samples":512,"bounces":12,"subdivide":{"triangles":8000}}]})");
  input.scene.main = *demo_scene("room");
  const auto output = bake(input, {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto certificate = report_of(*output)["certificate"];
  bool found = false;
  for (const auto& lighting : certificate["lightings"]) {
    if (lighting["name"] != "lamps") continue;
    found = true;
    EXPECT_LT(lighting["relrmse"].get<double>(), 0.06);  // measured .03 at 8000 triangles
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace kiln
