#pragma once
// The `reduce` step: a model of any size becomes a plain glTF of few triangles with a normal map
// (core/reduce/reduce.h).
//
// Result   scene.glb, report.json, log.txt, and preview.png under the job's light or an overcast sky; the plan says
// when
//          that would not fit into limits.memory_mb, and it is left out. A model that has no more triangles than asked
//          for comes back unchanged: byte for byte if it is a GLB, else as a GLB of the same triangles.
// Memory   limits.memory_mb bounds what the process holds; the input is mapped, and what does not fit is put aside in
//          BakeInput::spill_folder.

#include <string>

#include "core/bake/bake.h"

namespace kiln {

/// Where the recipe goes on with light, the reduced scene is baked by the rest of it: scene.glb and the other artefacts
/// are that bake's, and its report says what the reduction did, too.
/// Fails as open_triangles, plan_reduction and reduce do, and as bake does.
Result<BakeOutput> bake_reduced(const BakeInput&, const Progress&, Threads&, const Checkpoints&);

/// The plan as JSON, from the header alone.
Result<std::string> reduce_plan_json(const BakeInput&);

}  // namespace kiln
