#pragma once
// Whole bakes of random scenes by random recipes.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "core/bake/bake.h"
#include "core/base/random.h"
#include "tests/core/extremes/random_scene.h"

namespace kiln::test {

struct RandomRecipe {
  bool certificate = true;
};

/// A small recipe: every order, 1 to 64 samples, few or automatic bounces, budgets around the input's size, and any
/// kind of light.
inline std::string random_recipe(std::uint64_t seed, const RandomRecipe& choices) {
  Random random(seed, 0x72656369U);
  const auto below = [&](int n) { return static_cast<int>(random.next() % static_cast<std::uint64_t>(n)); };
  nlohmann::json step = {{"do", "prt"}, {"order", 1 + below(10)}, {"samples", 1 + below(64)}};
  if (below(3) > 0) step["bounces"] = below(5);
  step["subdivide"] = {{"triangles", 1 + below(600)}, {"max_depth", below(9)}};
  if (below(4) == 0) step["subdivide"]["threshold"] = below(2) == 0 ? 0.0 : 1e30;
  nlohmann::json recipe = {{"steps", {step}}, {"seed", seed}, {"certificate", choices.certificate}};
  const float bright = std::pow(10.0F, 16 * random.uniform() - 8);
  const int light = below(4);
  if (light == 1) recipe["environment"] = {{"constant", {bright, 0, 1}}};
  if (light == 2) recipe["environment"] = {{"builtin", "clear"}, {"intensity", bright}, {"rotation_deg", below(360)}};
  if (light == 3) recipe["environment"] = {{"builtin", "overcast"}};
  return recipe.dump();
}

inline BakeInput random_bake(std::uint64_t seed, const RandomRecipe& choices) {
  BakeInput input;
  input.scene = {.name = "scene.glb", .main = to_glb(random_scene(seed)), .resources = {}};
  const auto recipe = parse_recipe(random_recipe(seed, choices));
  if (!recipe) throw std::runtime_error(recipe.error().front().pointer + ": " + recipe.error().front().detail);
  input.recipe = *recipe;
  return input;
}

inline const Bytes& file_of(const BakeOutput& output, const std::string& name) {
  return std::find_if(output.files.begin(), output.files.end(), [&](const auto& f) { return f.name == name; })->bytes;
}

inline nlohmann::json report_of(const BakeOutput& output) {
  return nlohmann::json::parse(file_of(output, "report.json"));
}

}  // namespace kiln::test
