#pragma once
// A glTF container becomes a Scene.

#include "core/artifact/gltf_container.h"
#include "core/artifact/import.h"

namespace kiln::gltf {

enum class Radiance { read, leave };  // the radiance functions that a file may carry

struct GltfImport {
  const SceneFiles& files;
  const ImportLimits& limits;
  Radiance radiance = Radiance::leave;
};

/// All stages from JSON to the unit cube. The scene is valid unless `findings` has failed.
LitScene import_gltf(const GltfContainer&, const GltfImport&, Findings&);

}  // namespace kiln::gltf
