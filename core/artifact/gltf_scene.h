#pragma once
// A glTF container becomes a Scene.

#include "core/artifact/gltf_container.h"
#include "core/artifact/import.h"

namespace kiln::gltf {

/// All stages from JSON to the unit cube. The scene is valid unless `findings` has failed.
Scene import_gltf(const GltfContainer&, const SceneFiles&, const ImportLimits&, Findings&);

}  // namespace kiln::gltf
