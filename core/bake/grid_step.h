#pragma once
// The `grid` step: an irradiance vector grid of the scene's light (core/grid/bake_grid.h), beside the scene itself, lit
// as by the step `radiosity`, whose points are what the grid's rays look at.
//
// Promise  the grid is baked with kFirstLongest vertices along its longest side and doubled until the upper end of its
//          certificate's interval meets the target, or the next one would not fit time, memory or kMostLongest.
// Result   grid.exr. What its certificate judges is that file, read back.

#include <string>

#include "core/bake/bake_log.h"
#include "core/bake/grid_outcome.h"
#include "core/bake/plan.h"
#include "core/bake/recipe.h"

namespace kiln {

inline constexpr int kFirstLongest = 8, kMostLongest = 256;

/// The plan of `radiosity` with the grid added: decisions, seconds, memory, bytes.
Plan make_grid_plan(const Scene&, const Recipe&, const Environment* sky, Threads&);

/// What bake_grid_step is asked to do, and where.
struct GridTask {
  const SphereGather::World& world;
  const Recipe& recipe;
  std::string provenance;
};

/// Gathers, writes, reads back and certifies; where a promise was made, until it is kept or cannot be.
/// Adds to plan.decisions what it found. Fails  as read_grid_exr does.
Result<GridOutcome> bake_grid_step(const GridTask&, Plan&, BakeLog&, Threads&);

}  // namespace kiln
