#pragma once
// JSON documents pass between our files as text: no library type stands in a header.

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

/// What look_json's texts say. `images` is the number of images in the file.
struct LookText {
  std::string materials, textures, samplers, lights, light_nodes;
  std::size_t images = 0;
};
struct Look {
  std::vector<Material> materials;  // originals and twins
  std::vector<Texture> textures;
  std::vector<Light> lights;  // in unit-cube lengths
};
Result<Look> read_look(const LookText&, const Frame&);

}  // namespace kiln
