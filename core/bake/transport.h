#pragma once
// The `prt` step: direct transfer while the mesh is refined, then reflections between its surfaces.

#include <cstdint>

#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/prt/transfer.h"
#include "core/scene/scene.h"

namespace kiln {

/// Refines scene.mesh as planned and solves for light at its vertices. What the measurements show to be needless is
/// skipped and added to plan.decisions with its reason.
Transfer solve_transport(Scene& scene, Plan& plan, std::uint64_t seed, BakeLog& log, Threads& threads);

}  // namespace kiln
