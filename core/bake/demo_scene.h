#pragma once
// The bundled scenes, made by formula: small, ours, and showing what the methods are for.

#include <optional>
#include <string>
#include <vector>

#include "core/artifact/import.h"

namespace kiln {

/// Names of the scenes: "column" (a column, a box and a torus knot on a floor, for skies; after Krivanek et al. 2004,
/// figures 1 and 5) and "room" (a closed room with a ceiling lamp, a box and a coloured wall, for its own light).
const std::vector<std::string>& demo_scene_names();

/// The scene as an uncompressed GLB, or nothing for an unknown name. Lengths in metres.
std::optional<Bytes> demo_scene(const std::string& name);

}  // namespace kiln
