// How far the plan's predictions are off. Bakes scenes under the clear sky, each in a process of its own.
//   kiln_forecast [--quality draft|standard|final] [SCENE.glb ...]     the two demo scenes when none is named
//   kiln_forecast --target E [SCENE.glb ...]     of the promise of that error at order 6: all of its passes
// One JSON line a bake, predicted / measured of each figure, then the share of bakes within a factor 1.5. Asserts
// nothing.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client_cli/models.h"
#include "core/bake/bake.h"
#include "core/bake/demo_scene.h"
#include "tests/bench/trade/child.h"

namespace kiln {
namespace {

using nlohmann::ordered_json;

constexpr double kGoal = 1.5;

/// A demo scene's name, or a path. Read by the child: what the parent holds would count as its memory.
Result<SceneFiles> read(const std::string& scene) {
  if (const auto demo = demo_scene(scene)) return SceneFiles{.name = scene, .main = *demo};
  auto files = load_files(scene);
  if (!files) return fault(files.error().problem.code, files.error().problem.detail);
  return std::move(*files);
}

/// A promise, or a quality.
ordered_json recipe_of(const std::string& quality, const std::optional<double>& target) {
  ordered_json out = {{"environment", {{"builtin", "clear"}}}};
  if (!target) return out.update({{"quality", quality}}), out;
  out["steps"] = {{{"do", "prt"}, {"order", 6}}};
  out["quality"] = {{"target_error", *target}};
  return out;
}

/// The report of a bake; of a promise with the prediction of its plan in place of that of its last pass.
Result<std::string> report_of(const std::string& scene, const ordered_json& recipe) {
  KILN_TRY(files, read(scene));
  const BakeInput input{files, *parse_recipe(recipe.dump()), {}, {}};
  Threads threads;
  KILN_TRY(output, bake(input, {}, threads));
  for (const auto& file : output.files) {
    if (file.name != "report.json") continue;
    ordered_json report = ordered_json::parse(file.bytes.begin(), file.bytes.end());
    if (input.recipe.promise) {
      KILN_TRY(plan, plan_json(input, threads));
      report["prediction"] = ordered_json::parse(plan)["prediction"];
    }
    return report.dump();
  }
  return fault("no_report", "the bake gave no report");
}

ordered_json ratios(const ordered_json& report) {
  const ordered_json &predicted = report["prediction"], &result = report["result"];
  const std::vector<std::pair<const char*, double>> measured = {
      {"seconds", report["seconds"]},      {"memory_bytes", report["peak_memory_bytes"]},
      {"artifact_bytes", result["bytes"]}, {"rays", report["rays"]},
      {"vertices", result["vertices"]},    {"triangles", result["triangles"]}};
  ordered_json out;
  for (const auto& [name, value] : measured) out[name] = value > 0 ? predicted[name].get<double>() / value : 1.0;
  return out;
}

int run(int count, char** words) {
  std::string quality = "standard";
  std::optional<double> target;
  std::vector<std::string> scenes;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--quality" && i + 1 < count) {
      quality = words[++i];
      continue;
    }
    if (word == "--target" && i + 1 < count) {
      target = std::stod(words[++i]);
      continue;
    }
    scenes.push_back(word);
  }
  if (scenes.empty()) scenes = demo_scene_names();
  std::map<std::string, int> good;
  int bakes = 0;
  for (const std::string& scene : scenes) {
    const std::string name = std::filesystem::path(scene).stem().string();
    const auto text = trade::in_child([&] { return report_of(scene, recipe_of(quality, target)); });
    if (!text) {
      std::printf("%s\n", ordered_json{{"scene", name}, {"fault", text.error().code}}.dump().c_str());
      continue;
    }
    const ordered_json report = ordered_json::parse(*text), off = ratios(report);
    ordered_json line = {{"scene", name}, {"measured_seconds", report["seconds"]}};
    if (target) {
      line["target"] = *target;
      line["passes"] = {report["prediction"]["passes"], report["promise"]["passes"].size()};
      line["ended_by"] = {report["prediction"]["ended_by"], report["promise"]["ended_by"]};
    } else {
      line["quality"] = quality;
    }
    line.update(off);
    std::printf("%s\n", line.dump().c_str());
    std::fflush(stdout);
    ++bakes;
    for (const auto& [name, ratio] : off.items())
      good[name] += std::abs(std::log(ratio.get<double>())) <= std::log(kGoal);
  }
  ordered_json summary = {{"bakes", bakes}, {"within", kGoal}};
  for (const auto& [name, number] : good) summary[name] = number;
  std::printf("%s\n", summary.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run(count, words); }
