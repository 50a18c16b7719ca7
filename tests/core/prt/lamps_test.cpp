#include "core/prt/lamps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/core/prt/lamp_scenes.h"

namespace kiln {
namespace {

double corner_factor(double a, double b, double c) {
  const double x = a / c, y = b / c;
  return (x / std::sqrt(1 + x * x) * std::atan(y / std::sqrt(1 + x * x)) +
          y / std::sqrt(1 + y * y) * std::atan(x / std::sqrt(1 + y * y))) /
         (2 * std::numbers::pi);
}

Receiver on_the_floor(float x, float z) { return {{x, 0, z}, {0, 1, 0}}; }

Vec3f emitted_at(const Scene& scene, const Receiver& at, const EmitterRays& rays, std::uint64_t seed = 0) {
  Threads threads(1);
  const Tracer tracer(scene, threads);
  std::uint64_t sent = 0;
  return Lamps(tracer).emitted(at, rays, seed, sent);
}

TEST(Lamps, PointUnderALampReceivesItsFormFactor) {
  for (const float height : {0.3F, 0.1F, 0.01F, 0.001F}) {  // down to nearly touching
    const Vec3f value = emitted_at(testing::lamp_scene(height, 4), on_the_floor(0, 0), {.samples = 4096});
    const double expected = 4 * 4 * corner_factor(0.25, 0.25, height);
    EXPECT_NEAR(value.x / expected, 1, 0.01) << height;  // 1024 cosine rays at worst: 0.3 / 1024^0.5
    EXPECT_NEAR(value.y, value.x / 2, 1e-5F * value.x);
    EXPECT_EQ(value.z, 0.0F);
  }
}

TEST(Lamps, TheMeanOfManySmallRunsHasNoBias) {
  const Scene scene = testing::lamp_scene(0.05F, 1);
  double sum = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run)
    sum += emitted_at(scene, on_the_floor(0.2F, 0.1F), {.samples = 8}, static_cast<std::uint64_t>(run)).x;
  const double expected = corner_factor(0.45, 0.35, 0.05) + corner_factor(0.05, 0.35, 0.05) +
                          corner_factor(0.45, 0.15, 0.05) + corner_factor(0.05, 0.15, 0.05);
  EXPECT_NEAR(sum / kRuns, expected, 0.02 * expected);  // standard error: about 0.15 / sqrt(400)
}

/// Where samples agree they are all that is taken, with the value of as many; near the lamp's edge more are, and the
/// error falls.
TEST(Lamps, OnlyPointsWithALargeErrorTakeMoreRays) {
  const Scene scene = testing::lamp_scene(0.01F, 1);
  Threads threads(1);
  const Tracer tracer(scene, threads);
  const Lamps lamps(tracer);
  constexpr std::uint64_t kOfOnePoint = 64 + 16;
  const EmitterRays plain{.samples = 64}, adaptive{.samples = 64, .reach = 16, .tolerance = 0.01F};
  std::uint64_t rays = 0;
  const Receiver far = on_the_floor(0.45F, 0.45F);
  const Vec3f once = lamps.emitted(far, plain, 3, rays), again = lamps.emitted(far, adaptive, 3, rays = 0);
  EXPECT_EQ(rays, kOfOnePoint);
  EXPECT_NEAR(again.x, once.x, 1e-6F);  // the same samples, summed in two parts

  constexpr int kPoints = 64;
  double before = 0, after = 0;
  std::uint64_t unused = 0;
  rays = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Receiver edge = on_the_floor(0.25F, -0.2F + 0.006F * static_cast<float>(i));
    const auto seed = static_cast<std::uint64_t>(i);
    const float truth = lamps.emitted(edge, {.samples = 16384}, seed + 1000, unused).x;
    before += std::pow(lamps.emitted(edge, plain, seed, unused).x - truth, 2);
    after += std::pow(lamps.emitted(edge, adaptive, seed, rays).x - truth, 2);
  }
  EXPECT_GT(rays, 2 * kOfOnePoint * kPoints);
  EXPECT_LT(after, before / 4);  // half the error: four times the samples, of independent ones
}

}  // namespace
}  // namespace kiln
