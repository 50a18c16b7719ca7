#pragma once
// The `radiosity` step: light of one job at the vertices, all reflections (core/meshless/radiosity.h).
// The mesh is refined where direct light changes, as for `prt`; then reflected light is solved on points.
// Result  a Transfer of order 0 whose only slot is that light.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/bake/transport.h"
#include "core/base/threads.h"
#include "core/meshless/lit_surface.h"
#include "core/prt/transfer.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

/// What a bake spends where the recipe does not say.
struct RadiosityEffort {
  const char* reason;
  std::uint64_t triangles;  // added where direct light changes
  float threshold;          // of a split
  DirectRays direct;
  int rays;  // of a gather
  float eps;
  double points;           // times the automatic number
  double storage = 0.005;  // relRMSE that rounding may add
};
RadiosityEffort radiosity_effort(Quality);
/// Of the first, coarse pass towards a promise (progressive.h).
RadiosityEffort radiosity_effort(const Promise&);

/// What will be done and what it will cost. `sky` is the job's environment, or null. Seconds come from a pilot of
/// direct light; reflected rays are priced as in forecast.h.
Plan make_radiosity_plan(const Scene&, const RadiosityStep&, const RadiosityEffort&, const Environment* sky, Threads&);

/// Of a later pass, by how much it grows; triangles are the plan's.
struct RadiosityGrowth {
  double direct = 1, reflected = 1;  // rays of a vertex, of a gather
  double points = 1;                 // and what is asked of their predictions (eps), unless that is fixed
  bool eps_fixed = false;
  std::string reason = {};  // of the decisions
};
void grow_radiosity(Plan&, const RadiosityGrowth&, const Scene&);

/// Called while the solved surface stands (null where nothing is reflected), with the light of each vertex.
using OnLit = std::function<void(const Tracer&, const LitSurface*, std::span<const Vec3f>)>;

/// Other light that the mesh is refined for: `width` numbers for each place, 1 in the mean.
struct MoreLight {
  std::size_t width = 0;
  std::function<std::vector<float>(std::span<const TransferPoint>)> values = {};
};

struct RadiosityHooks {
  OnLit lit = {};
  MoreLight more = {};
  bool sources = false;  // whether it is to be found where errors come from
};

/// The light, and with `sources` what split_error (error_sources.h) asks for.
struct SolvedRadiosity {
  Transfer transfer;
  std::uint64_t gather_rays = 0, points = 0, gathered = 0;
  NoiseProbes noise;
  double points_squared = 0, tail = 0;
};

/// Refines scene.mesh as planned and solves for the light at its vertices. Adds to plan.decisions what it found.
SolvedRadiosity solve_radiosity_step(Scene& scene, Plan& plan, const Environment* sky, const RadiosityHooks&, BakeLog&,
                                     Threads&);

}  // namespace kiln
