// Values at vertices against an independent path tracer (shared/models/references).

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "core/artifact/import.h"
#include "core/prt/interreflection.h"
#include "core/sphere/sh.h"
#include "tests/core/prt/reference_set.h"

namespace kiln {
namespace {

using testing::ReferenceSet;
using testing::RelativeError;

struct Job {
  int order = 1;
  int samples = 1024;
  int bounces = 0;
  int bounce_samples = 256;
  std::vector<Vec3f> light;  // empty: the scene's lamps
};

std::vector<Vec3f> bake_values(const ReferenceSet& set, const Job& job) {
  Threads threads(2);
  const Tracer tracer(set.scene, threads);
  const std::vector<TransferPoint> points = vertex_points(set.scene.mesh);
  std::vector<float> direct(points.size() * static_cast<std::size_t>(sh_count(job.order)), 0.0F);
  std::vector<Vec3f> fixed;
  if (job.light.empty()) {
    fixed = bake_fixed_direct(tracer, points, {.samples = job.samples}, threads);
  } else {
    direct = bake_direct_transfer(tracer, points, {.order = job.order, .samples = job.samples}, threads);
  }
  const Interreflection params{.order = job.order, .bounces = job.bounces, .samples = job.bounce_samples};
  const Transfer t = bake_interreflection(tracer, set.scene.mesh, std::move(direct), std::move(fixed), params, threads);
  std::vector<Vec3f> out;
  for (const std::uint32_t v : set.vertex) {
    Vec3f value;
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      for (std::size_t i = 0; i < job.light.size(); ++i) value[channel] += job.light[i][channel] * t.at(v, c)[i];
      if (t.fixed) value[channel] += t.at(v, c)[t.slots() - 1];
    }
    out.push_back(value);
  }
  return out;
}

RelativeError compare(const ReferenceSet& set, const Job& job, const std::string& reference) {
  const RelativeError error = testing::relative_error(bake_values(set, job), set.values(reference));
  std::printf("%s: relRMSE %.4f, without the worst 1 %% %.4f\n", reference.c_str(), error.all, error.without_worst);
  return error;
}

// sky.hdr projected to SH; empty when it is not there.
std::vector<Vec3f> sky(int order) {
  std::ifstream file(KILN_SHARED "/models/references/sky.hdr", std::ios::binary);
  const Bytes bytes{std::istreambuf_iterator<char>(file), {}};
  const Result<Environment> environment = import_environment(bytes, "sky.hdr");
  return environment ? project_environment(*environment, order) : std::vector<Vec3f>{};
}

const std::vector<Vec3f> kUniform = {{3.5449077F, 3.5449077F, 3.5449077F}};  // 1 / Y00: radiance 1

TEST(ReferenceValues, CornellBoxUnderItsLamp) {
  const auto set = testing::load_reference_set(KILN_SHARED, "cornell");
  if (!set) GTEST_SKIP() << "shared/models/references is not there";
  ASSERT_GT(set->vertex.size(), 25000U);
  // The reference's own noise is .005. Ours falls as stratified noise does: .022 at 64 lamp samples, .0065 at 256.
  EXPECT_LT(compare(*set, {.samples = 256}, "cornell.dir").without_worst, 0.01);
  // With bounces .0286 was measured at 64 rays and .0118 at 256; ten bounces leave out .002.
  EXPECT_LT(compare(*set, {.samples = 256, .bounces = 10, .bounce_samples = 64}, "cornell.comb").without_worst, 0.032);
}

TEST(ReferenceValues, BunnyUnderAUniformSky) {
  const auto set = testing::load_reference_set(KILN_SHARED, "bunny");
  if (!set) GTEST_SKIP() << "shared/models/references is not there";
  ASSERT_GT(set->vertex.size(), 35000U);
  // Reference noise .0015; a plain tracer needs 1024 samples for .0043 (anchors.md), here .0047 was measured.
  EXPECT_LT(compare(*set, {.samples = 1024, .light = kUniform}, "bunny.dir").without_worst, 0.006);
  const Job bounced{.samples = 1024, .bounces = 5, .bounce_samples = 256, .light = kUniform};
  EXPECT_LT(compare(*set, bounced, "bunny.comb").without_worst, 0.01);
}

TEST(ReferenceValues, BunnyUnderAProjectedSky) {
  const auto set = testing::load_reference_set(KILN_SHARED, "bunny");
  if (!set) GTEST_SKIP() << "shared/models/references is not there";
  const std::vector<Vec3f> light = sky(6);
  ASSERT_EQ(light.size(), 36U);
  // Reference noise .002 without and .015 with bounces, which it interpolates between vertices.
  // Ours at 1024 rays: .021 of the coefficients (anchors.md), half of it under a sky that is not all noise.
  EXPECT_LT(compare(*set, {.order = 6, .samples = 1024, .light = light}, "bunnyp.dir").without_worst, 0.0125);
  const Job bounced{.order = 6, .samples = 1024, .bounces = 5, .bounce_samples = 256, .light = light};
  EXPECT_LT(compare(*set, bounced, "bunnyp.comb").without_worst, 0.025);
}

}  // namespace
}  // namespace kiln
