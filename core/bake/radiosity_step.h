#pragma once
// The `radiosity` step: light of one job at the vertices, all reflections (core/meshless/radiosity.h).
// Reflected light is solved on points, which know nothing of the mesh; then the mesh is refined where all light
// changes. Result  a Transfer of order 0 whose only slot is that light.

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
  std::uint64_t triangles;  // added where light changes
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

/// Called while the solved surface of the input (null where nothing is reflected) stands with its tracer, with the
/// refined mesh and the light of each of its vertices.
using OnLit = std::function<void(const Tracer&, const LitSurface*, const Mesh& refined, std::span<const Vec3f>)>;

/// Other light that the mesh is refined for: `width` numbers for each place, 1 in the mean.
struct MoreLight {
  std::size_t width = 0;
  std::function<std::vector<float>(std::span<const TransferPoint>)> values = {};
};

/// The light of places besides the vertices, and how more direct light is found.
struct LitPlaces {
  std::span<const Vec3f> direct, reflected;
  std::function<std::vector<Vec3f>(std::span<const TransferPoint>)> direct_at;
  const Tracer& tracer;
};

struct RadiosityHooks {
  OnLit lit = {};
  MoreLight more = {};
  std::vector<TransferPoint> places = {};                                              // besides the vertices,
  std::function<void(const LitPlaces&)> lit_places = {};                               // told their light
  std::function<void(const PointHierarchy&, std::span<const Vec3f>)> lit_points = {};  // told the light of the points
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
