// A grid of the Cornell box against an independent path tracer's indirect light (shared/models/references).

#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "core/grid/bake_grid.h"
#include "core/meshless/radiosity.h"
#include "tests/core/prt/reference_set.h"

namespace kiln {
namespace {

double error_of(const testing::ReferenceSet& set, const Grid& grid) {
  std::vector<Vec3f> values, truth = set.values("cornell.comb");
  const std::vector<Vec3f> direct = set.values("cornell.dir");
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] -= direct[i];
  const Mesh& mesh = set.scene.mesh;
  for (const std::uint32_t v : set.vertex) {
    const Vec3f e = irradiance_at(grid, to_double(mesh.position[v]), mesh.normal[v]);
    values.push_back(e * std::numbers::inv_pi_v<float>);
  }
  const double error = testing::relative_error(values, truth).all;
  std::printf("relRMSE %.4f\n", error);
  return error;
}

TEST(GridReferenceValues, IndirectLightOfTheCornellBoxAt16) {
  const auto set = testing::load_reference_set(KILN_SHARED, "cornell");
  if (!set) GTEST_SKIP() << "shared/models/references is not there";
  Threads threads(2);
  const Tracer tracer(set->scene, threads);
  const RadiosityResult light = solve_radiosity(tracer, nullptr, {}, threads);
  const auto grid_with = [&](GridBlend blend) {
    return bake_grid({tracer, light.surface->faces(), light.surface.get(), nullptr},
                     {.size = {16, 16, 16}, .blend = blend, .rays = 512}, threads)
        .grid;
  };
  const double exact = error_of(*set, grid_with(GridBlend::exact)), paper = error_of(*set, grid_with(GridBlend::paper));
  // Measured .030 (.054 before the fit to the surface, .021 with a ray to each corner at every look-up); issue 5 asks
  // for .05. Twelve textures .096, a trial of them with another tracer .092.
  EXPECT_LT(exact, 0.035);
  EXPECT_GT(paper, exact);
  EXPECT_LT(paper, 0.105);
}

}  // namespace
}  // namespace kiln
