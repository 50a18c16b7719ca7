#pragma once
// Bakes of the bundled scenes, for the tests of this folder.

#include <nlohmann/json.hpp>
#include <string>

#include "core/artifact/glb.h"
#include "core/bake/bake.h"
#include "core/bake/demo_scene.h"
#include "tests/core/bake/output_file.h"

namespace kiln::testing {

inline BakeInput input_of(const std::string& scene, const std::string& recipe) {
  BakeInput input;
  input.scene.name = scene + ".glb";
  input.scene.main = *demo_scene(scene);
  input.recipe = *parse_recipe(recipe);
  return input;
}

/// A bundled scene with other finishes: {"knot": {"metallicFactor": 1, "roughnessFactor": 0.5}}.
inline BakeInput finished(const std::string& scene, const std::string& recipe, const nlohmann::json& finishes) {
  BakeInput input = input_of(scene, recipe);
  const auto chunks = split_glb(input.scene.main);
  nlohmann::json document = nlohmann::json::parse(chunks->json);
  for (nlohmann::json& material : document["materials"]) {
    const std::string name = material["name"];
    if (finishes.contains(name)) material["pbrMetallicRoughness"].update(finishes[name]);
  }
  input.scene.main = *join_glb(document.dump(), Bytes(chunks->binary.begin(), chunks->binary.end()));
  return input;
}

inline nlohmann::json report_of(const BakeOutput& output) { return nlohmann::json::parse(file(output, "report.json")); }

}  // namespace kiln::testing
