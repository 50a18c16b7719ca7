#pragma once
// Bakes of the bundled scenes, for the tests of this folder.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "core/bake/bake.h"
#include "core/bake/demo_scene.h"

namespace kiln::testing {

inline BakeInput input_of(const std::string& scene, const std::string& recipe) {
  BakeInput input;
  input.scene.name = scene + ".glb";
  input.scene.main = *demo_scene(scene);
  input.recipe = *parse_recipe(recipe);
  return input;
}

inline const Bytes& file(const BakeOutput& output, const std::string& name) {
  return std::find_if(output.files.begin(), output.files.end(), [&](const auto& f) { return f.name == name; })->bytes;
}

inline nlohmann::json report_of(const BakeOutput& output) { return nlohmann::json::parse(file(output, "report.json")); }

}  // namespace kiln::testing
