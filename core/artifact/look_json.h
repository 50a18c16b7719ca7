#pragma once
// Materials, textures and lights as glTF. JSON passes between our files as text: no library type stands in a header.

#include <cstdint>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"

namespace kiln {

/// glTF arrays as JSON text. Materials: the originals in their order, then an unlit twin of each (index + count).
/// Nodes: the lights' nodes only. Empty arrays come as "[]".
struct LookJson {
  std::string materials, textures, samplers, lights, light_nodes;
  std::vector<std::string> extensions;  // used by them, sorted
};
LookJson look_json(const Scene&);

}  // namespace kiln
