#pragma once
// One bake from bytes to artefacts: the outline of the whole service.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/artifact/import.h"
#include "core/bake/recipe.h"
#include "core/base/progress.h"
#include "core/base/result.h"
#include "core/base/threads.h"

namespace kiln {

/// Part of every result's identity: the same scene, recipe and engine give the same bytes.
inline constexpr const char* kEngineVersion = "0.19.0";

struct BakeInput {
  SceneFiles scene;
  Recipe recipe;
  Bytes environment;  // the file the recipe's environment names; empty for constant, built-in or none
  std::string environment_name;
  std::string made_of;             // JSON for asset.extras.kiln; empty: made from scene and recipe (provenance.h)
  std::string spill_folder = ".";  // where a reduction puts aside what does not fit into memory
};

/// Named files with their media types: scene.glb, lod1.glb and on and grid.exr where the recipe asks for them,
/// preview.png (a reduction leaves it out where memory does not allow it), report.json, log.txt.
struct ArtifactFile {
  std::string name;
  std::string media_type;
  Bytes bytes;
};

struct BakeOutput {
  std::vector<ArtifactFile> files;
};

/// How a bake in passes outlives its process (checkpoint.h).
struct Checkpoints {
  std::string last;                                   // what an earlier bake of the same input saved last; may be empty
  std::function<void(const std::string& text)> save;  // called after each pass
};

/// Bakes. Throws Cancelled when `threads` is stopped; a Fault names what is wrong with the input.
Result<BakeOutput> bake(const BakeInput&, const Progress&, Threads&, const Checkpoints& = {});

/// The plan of a bake as JSON: what is modelled, what skipped and why, predictions. Of an error target the first pass
/// is baked for a trial.
Result<std::string> plan_json(const BakeInput&, Threads&);

}  // namespace kiln
