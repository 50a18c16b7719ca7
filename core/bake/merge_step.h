#pragma once
// Merging before splitting: what an input has more vertices for than its light and shape need (core/lightfield).
//
// Transfer is drawn twice at the input's vertices, by a quarter of the rays each and two reflections at most. Edges
// collapse in the order of what they change of it; noise, which differs between the draws, is taken off. Distances are
// those of the certificate: each band by the power that its lightings have in it, each kind of light in parts of its
// mean over the surface. Beside light count what else a vertex shows: its colour; texture coordinates, by how much the
// textures change; the normals of parts that reflect specularly, by how sharply.
// Shape   collapse_reach.h.   Repeat  same bits for any thread count

#include <vector>

#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/scene/scene.h"

namespace kiln {

inline constexpr int kMergeReflections = 2;  // the first ones have what detail there is

struct MergeOutcome {
  std::uint64_t input_triangles = 0, input_vertices = 0, triangles = 0, vertices = 0;
  double error = 0;                           // relRMSE that it added, as simplify.h estimates it
  double distance_rms = 0, distance_max = 0;  // of the input's vertices from the result, in parts of the box's diagonal
};

/// Merges scene.mesh by plan.merge. Where the recipe gives no budget for splits, plan.subdivide then has one.
MergeOutcome merge_scene(Scene& scene, Plan& plan, const std::vector<double>& band_power, std::uint64_t seed,
                         BakeLog& log, Threads& threads);

}  // namespace kiln
