#pragma once
// The levels of detail of a light field: the delivered scene, simplified as far as its light allows or as the recipe
// asks, and coarser ones that follow from it. Every level is simplified further from the one before it.

#include <functional>
#include <optional>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/bake/bake_log.h"
#include "core/bake/error_stats.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/lightfield/progressive_mesh.h"
#include "core/lightfield/simplify.h"

namespace kiln {

struct FieldLevel {
  Mesh mesh;
  LightField field;
  Transfer transfer;    // diffuse light of its vertices, read from the nearest place of the baked surface
  double estimate = 0;  // relRMSE that simplification added, of all steps up to here
  bool reached = true;  // the asked number of triangles
};

struct FieldLevels {
  std::optional<ErrorStats> baked;             // the error before simplification, where the plan has a target
  std::vector<FieldLevel> levels;              // the first is the delivered scene
  std::optional<ProgressiveMesh> progressive;  // from the last level to the first, if asked
};

/// The error of a mesh and its field, with its interval.
using JudgeLevel = std::function<ErrorStats(const Mesh&, const LightField&)>;

/// From the scene as it was baked, its transfer of order 0 and its field. `judge` is asked where the plan has a target:
/// then the first level is the last in a row of ever coarser ones whose interval ends below it. Where the baked scene
/// itself misses the target, simplification may add a quarter of its error.
FieldLevels make_levels(const Mesh&, const Transfer&, LightField, const FieldPlan&, const JudgeLevel& judge, BakeLog&,
                        Threads&);

}  // namespace kiln
