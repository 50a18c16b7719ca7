// Radiosity at vertices against an independent path tracer (shared/models/references).

#include <gtest/gtest.h>

#include <cstdio>

#include "core/meshless/radiosity.h"
#include "tests/core/prt/reference_set.h"

namespace kiln {
namespace {

using testing::ReferenceSet;
using testing::RelativeError;

RelativeError compare(const ReferenceSet& set, const std::vector<Vec3f>& at_vertices, const std::string& reference) {
  std::vector<Vec3f> values;
  for (const std::uint32_t v : set.vertex) values.push_back(at_vertices[v]);
  const RelativeError error = testing::relative_error(values, set.values(reference));
  std::printf("%s: relRMSE %.4f, without the worst 1 %% %.4f\n", reference.c_str(), error.all, error.without_worst);
  return error;
}

struct Solved {
  std::vector<Vec3f> direct, all;
};

Solved solve(const ReferenceSet& set, const Environment* sky, const Radiosity& params) {
  Threads threads(2);
  const Tracer tracer(set.scene, threads);
  RadiosityResult r = solve_radiosity(tracer, sky, params, threads);
  Solved out{r.direct, std::move(r.direct)};
  for (std::size_t v = 0; v < out.all.size(); ++v) out.all[v] += r.indirect[v];
  return out;
}

TEST(RadiosityReferenceValues, CornellBoxUnderItsLamp) {
  const auto set = testing::load_reference_set(KILN_SHARED, "cornell");
  if (!set) GTEST_SKIP() << "shared/models/references is not there";
  ASSERT_GT(set->vertex.size(), 25000U);
  const Solved r = solve(*set, nullptr, {});
  // The reference's own noise is .005. Measured: direct .0072, all .0080.
  EXPECT_LT(compare(*set, r.direct, "cornell.dir").all, 0.009);
  EXPECT_LT(compare(*set, r.all, "cornell.comb").all, 0.01);
}

TEST(RadiosityReferenceValues, BunnyUnderAUniformSky) {
  const auto set = testing::load_reference_set(KILN_SHARED, "bunny");
  if (!set) GTEST_SKIP() << "shared/models/references is not there";
  ASSERT_GT(set->vertex.size(), 35000U);
  const Environment sky = constant_sky({1, 1, 1});
  const Solved r = solve(*set, &sky, {});
  // The reference's own noise is .0015. Measured: direct .0112 (stratified at 256 rays, as core/prt), all .0149, and
  // .0076 at 1024 rays and 60000 points; without turning what is read to the vertex's normal .0232.
  EXPECT_LT(compare(*set, r.direct, "bunny.dir").without_worst, 0.013);
  EXPECT_LT(compare(*set, r.all, "bunny.comb").without_worst, 0.017);
}

}  // namespace
}  // namespace kiln
