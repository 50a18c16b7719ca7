// The smallest budgets: fewer triangles than there are, one ray, one bounce, thresholds of none and of infinity.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/artifact/baked_scene.h"
#include "core/bake/demo_scene.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/interreflection.h"
#include "core/prt/subdivide.h"
#include "tests/core/extremes/random_bake.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A kink: changes at every scale along one line.
ValueSource kink() {
  return {1, [](std::span<const TransferPoint> points) {
            std::vector<float> out;
            for (const TransferPoint& p : points) out.push_back(std::abs(p.position.x + 0.01F));
            return out;
          }};
}

Subdivided split(const Scene& scene, const Subdivide& params) {
  Threads threads(2);
  return subdivide(scene.mesh, kink(), params, threads);
}

Scene floor_of(int cells) {
  Scene scene = kiln::testing::empty_scene();
  kiln::testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, cells, cells);
  return scene;
}

TEST(Budgets, FewerTrianglesThanTheInputHasLeaveItAsItIs) {
  const Scene scene = floor_of(4);
  for (const std::uint64_t triangles : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{31}, std::uint64_t{32}}) {
    const Subdivided out = split(scene, {.triangles = triangles});
    EXPECT_EQ(out.mesh.triangles, scene.mesh.triangles) << triangles;
    EXPECT_EQ(out.evaluated, scene.mesh.position.size()) << triangles;
    for (std::size_t v = 0; v < out.values.size(); ++v) {
      EXPECT_EQ(out.values[v], std::abs(scene.mesh.position[v].x + 0.01F)) << triangles;
    }
  }
}

TEST(Budgets, AThresholdOfNoneSpendsAllAndOneOfInfinityNothing) {
  const Scene scene = floor_of(4);
  for (const SplitMeasure measure : {SplitMeasure::residual, SplitMeasure::eq2, SplitMeasure::eq3, SplitMeasure::eq4}) {
    const Subdivided all = split(scene, {.measure = measure, .threshold = 0, .triangles = 500, .max_depth = 16});
    EXPECT_LE(all.mesh.triangles.size(), 500U);
    EXPECT_GE(all.mesh.triangles.size(), 490U);  // a split and its neighbours' closure may need up to ten
    const Subdivided none = split(scene, {.measure = measure, .threshold = kInfinity, .triangles = 500});
    EXPECT_EQ(none.mesh.triangles, scene.mesh.triangles);
    EXPECT_EQ(none.mesh.position, scene.mesh.position);
  }
}

TEST(Budgets, OneRayIsNoisyButNotWrong) {
  // One sample is rounded up to a packet. Under a sheet that hides a quarter the mean of many seeds is the form factor.
  Scene scene = floor_of(1);
  kiln::testing::add_grid(scene, {0, 0.25F, -0.5F}, {0.5F, 0, 0}, {0, 0, 1}, 1, 1);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const TransferPoint middle{{0, 0, 0}, {0, 1, 0}, {0, 0, 0}, {0, 1, 0}};
  double sum = 0;
  constexpr int kSeeds = 2000;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const float x =
        bake_direct_transfer(tracer, std::span(&middle, 1), {.order = 1, .samples = 1, .seed = seed}, threads)[0] /
        0.28209479F;
    EXPECT_GE(x, 0);
    EXPECT_LE(x, 1 + 1e-6F);
    sum += x;
  }
  // Two corners of 0.5 x 0.5 at a height of 0.25 (Hamilton 1952): x = y = 2.
  const double hidden = 2 * (2 * 2 / std::sqrt(5) * std::atan(2 / std::sqrt(5))) / (2 * 3.14159265358979);
  EXPECT_NEAR(sum / kSeeds, 1 - hidden, 4 * 0.5 / std::sqrt(16.0 * kSeeds));  // no worse than independent rays
}

TEST(Budgets, OneBounceIsOneTermOfTheSeries) {
  Scene scene = kiln::testing::empty_scene();
  const std::uint32_t part = kiln::testing::add_part(scene, {0.5F, 0.5F, 0.5F});
  kiln::testing::add_box(scene, {-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}, 2, true, part);
  const std::size_t count = scene.mesh.position.size();
  Threads threads(1);
  const Tracer tracer(scene, threads);
  for (const int samples : {1, 16, 256}) {
    const Transfer t =
        bake_interreflection(tracer, scene.mesh, std::vector<float>(count, 0.0F), std::vector<Vec3f>(count, {1, 1, 1}),
                             {.order = 1, .bounces = 1, .samples = samples}, threads);
    for (std::size_t v = 0; v < count; ++v) {
      EXPECT_LE(t.at(v, 0)[1], 1.5F + 1e-5F);
      EXPECT_GE(t.at(v, 0)[1], 1.5F - 0.5F * 0.07F);  // a ray of sixteen through a seam
    }
  }
}

TEST(Budgets, TheSmallestRecipeBakes) {
  BakeInput input{.scene = {.name = "scene.glb", .main = *demo_scene("room")}};
  input.recipe =
      *parse_recipe(R"({"environment":{"constant":[1,1,1]},"steps":[{"do":"prt","order":1,"samples":1,"bounces":1,)"
                    R"("encoding":{"bits":8},"subdivide":{"triangles":1,"max_depth":0,"threshold":1e30}}]})");
  Threads threads(2);
  const auto output = bake(input, {}, threads);
  ASSERT_TRUE(output) << output.error().message;
  const auto baked = read_baked_glb(file_of(*output, "scene.glb"));
  ASSERT_TRUE(baked);
  const Scene scene = *import_scene(input.scene);
  EXPECT_EQ(baked->scene.mesh.triangles.size(), scene.mesh.triangles.size());
  for (std::size_t v = 0; v < baked->transfer.vertices(); ++v) {
    const float x = baked->transfer.at(v, 0)[0] / 0.28209479F;
    EXPECT_GE(x, -1e-4F);
    EXPECT_LE(x, 1 + 1e-4F);  // 16 bits, and 8 over the slot's own range
  }
}

}  // namespace
}  // namespace kiln::test
