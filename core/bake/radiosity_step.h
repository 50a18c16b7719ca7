#pragma once
// The `radiosity` step: light of one job at the vertices, all reflections (core/meshless/radiosity.h).
// The mesh is refined where direct light changes, as for `prt`; then reflected light is solved on points.
// Result  a Transfer of order 0 whose only slot is that light.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/meshless/lit_surface.h"
#include "core/prt/transfer.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

/// What will be done and what it will cost. `sky` is the job's environment, or null. Seconds come from a pilot of
/// direct light; reflected rays are priced as in forecast.h.
Plan make_radiosity_plan(const Scene&, const RadiosityStep&, Quality, const Environment* sky, Threads&);

/// Called while the solved surface stands (null where nothing is reflected), with the light of each vertex.
using OnLit = std::function<void(const Tracer&, const LitSurface*, std::span<const Vec3f>)>;

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
};

/// Refines scene.mesh as planned and solves for the light at its vertices. Adds to plan.decisions what it found.
Transfer solve_radiosity_step(Scene& scene, Plan& plan, const Environment* sky, const RadiosityHooks&, BakeLog&,
                              Threads&);

}  // namespace kiln
