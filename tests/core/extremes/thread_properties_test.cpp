// The thread count changes not one bit, on every scene.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/bake/bake.h"
#include "core/base/random.h"
#include "core/trace/reference.h"
#include "tests/core/extremes/random_bake.h"
#include "tests/core/extremes/seeds.h"

namespace kiln::test {
namespace {

TEST(ThreadProperty, OneTwoAndThreeThreadsBakeTheSameBytes) {
  for_seeds(60, [](std::uint64_t seed) {
    const BakeInput input = random_bake(seed, {.certificate = false});
    Threads one(1), two(2), three(3);
    const Result<BakeOutput> a = bake(input, {}, one), b = bake(input, {}, two), c = bake(input, {}, three);
    ASSERT_EQ(a.has_value(), b.has_value());
    ASSERT_EQ(a.has_value(), c.has_value());
    if (!a) return;
    for (const char* name : {"scene.glb", "preview.png"}) {
      EXPECT_EQ(file_of(*a, name), file_of(*b, name)) << name;
      EXPECT_EQ(file_of(*a, name), file_of(*c, name)) << name;
    }
  });
}

TEST(ThreadProperty, OneAndThreeThreadsGiveTheSameCertificate) {
  for_seeds(4, [](std::uint64_t seed) {
    const BakeInput input = random_bake(seed, {.certificate = true});
    Threads one(1), three(3);
    const Result<BakeOutput> a = bake(input, {}, one), b = bake(input, {}, three);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) return;
    auto first = report_of(*a)["certificate"], second = report_of(*b)["certificate"];
    for (auto* certificate : {&first, &second}) certificate->erase("seconds");
    EXPECT_EQ(first, second);
  });
}

TEST(ThreadProperty, TheReferenceGivesTheSameBits) {
  for_seeds(200, [](std::uint64_t seed) {
    const std::optional<Scene> scene = imported(random_scene(seed));
    if (!scene) return;
    Threads one(1), three(3);
    const Tracer tracer(*scene, one);
    std::vector<ReferencePoint> points;
    for (std::size_t v = 0; v < std::min<std::size_t>(40, scene->mesh.position.size()); ++v) {
      points.push_back({scene->mesh.position[v], scene->mesh.normal[v], scene->mesh.normal[v]});
    }
    const ReferenceLight light{.environments = {constant_sky({1, 2, 3})}, .scene_lights = true};
    const ReferenceOptions options{.samples = 8, .seed = seed};
    const ReferenceResult a = trace_reference(tracer, points, light, options, one),
                          b = trace_reference(tracer, points, light, options, three);
    EXPECT_EQ(a.value, b.value);
    for (const Vec3d& x : a.value) EXPECT_TRUE(is_finite(x));
  });
}

}  // namespace
}  // namespace kiln::test
