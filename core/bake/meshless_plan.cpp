#include "core/bake/meshless_plan.h"

#include <algorithm>
#include <cmath>

#include "core/bake/plan.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr double kFewest = 512, kMost = 262144;
constexpr double kMatrixShare =
    0.3;  // points over vertices: with those that see no point at most a third have matrices

/// What the recipe leaves open follows from the number of points that is wanted.
PointPlacement placed(const MeshlessPlan& plan, const Scene& scene, std::vector<bool> parts, double wanted) {
  PointPlacement out = plan.points;
  out.parts = std::move(parts);
  out.wanted = static_cast<std::uint64_t>(std::clamp(wanted, kFewest, kMost));
  return resolve(out, scene);
}

}  // namespace

PointPlacement sweep_points(const MeshlessPlan& plan, const Scene& scene, double vertices) {
  return placed(plan, scene, {}, vertices / 2);
}

PointPlacement matrix_points(const MeshlessPlan& plan, const Scene& scene, const std::vector<bool>& parts,
                             double vertices) {
  return placed(plan, scene, parts, kMatrixShare * vertices);
}

void plan_meshless(Plan& plan, const Scene& scene, const PrtStep& step, const Effort& effort) {
  if (!step.meshless)
    return decide(plan, "solver", "vertices", "reflected light and matrices are computed at every vertex");
  const PrtStep::Meshless& asked = *step.meshless;
  MeshlessPlan out;
  if (asked.radius) out.points.radius = static_cast<float>(std::max(*asked.radius / scene.frame.scale, 1e-30));
  out.points.levels = asked.levels.value_or(0);
  out.eps = static_cast<float>(2 * effort.noise);
  out.eps_transfer = static_cast<float>(asked.eps_transfer.value_or(20 * effort.noise));
  plan.meshless = out;
  decide(plan, "solver", "meshless", "asked for by the recipe: reflected light and matrices are computed at points");
  if (plan.glossy) {
    decide(plan, "eps_transfer", short_text(double{out.eps_transfer}),
           asked.eps_transfer ? "asked for by the recipe" : effort.reason);
  }
}

}  // namespace kiln
