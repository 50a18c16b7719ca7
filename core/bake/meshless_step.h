#pragma once
// The `prt` step's second way, solver: meshless: reflected light and matrices on points, read at the vertices
// (core/meshless). Direct light, the mesh, storage and the certificate are those of the first (transport.h).

#include <cstdint>
#include <span>
#include <vector>

#include "core/bake/bake_log.h"
#include "core/bake/meshless_plan.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/prt/hidden.h"
#include "core/trace/tracer.h"

namespace kiln {

/// What both take: the refined mesh with its tracer, and direct light at its vertices.
struct MeshlessWork {
  const Tracer& tracer;
  const Plan& plan;
  const std::vector<double>& band_power;  // lightings.h
  std::uint64_t seed = 0;
  BakeLog& log;
  Threads& threads;
  MeshlessOutcome& outcome;
};

/// Reflected light. `probes`: vertices where it is drawn twice.
SweptTransfer sweep_on_points(const MeshlessWork&, const std::vector<float>& sky, const std::vector<Vec3f>& lamps,
                              const std::vector<StandIn>& stand_ins, const std::vector<std::uint32_t>& probes);

/// Matrices of `vertices`; `bake` as for bake_glossy.
GlossyBaked matrices_on_points(const MeshlessWork&, const Transfer& light, std::span<const std::uint32_t> vertices,
                               GlossyBake bake);

}  // namespace kiln
