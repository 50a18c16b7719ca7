#pragma once
// The `reduce` step: a model of any size becomes a plain glTF of few triangles with a normal map
// (core/reduce/reduce.h).
//
// Result   scene.glb, report.json, log.txt. A model that has no more triangles than asked for comes back unchanged:
// byte
//          for byte if it is a GLB, else as a GLB of the same triangles.
// Memory   limits.memory_mb bounds what the process holds; the input is mapped, and what does not fit is put aside in
//          BakeInput::spill_folder.

#include <string>

#include "core/bake/bake.h"

namespace kiln {

/// Fails as open_triangles, plan_reduction and reduce do.
Result<BakeOutput> bake_reduced(const BakeInput&, const Progress&, Threads&);

/// The plan as JSON, from the header alone.
Result<std::string> reduce_plan_json(const BakeInput&);

}  // namespace kiln
