// Are promised errors kept? Bakes scenes to a list of targets and measures each result again at 8192 other points.
//   kiln_promises [--step prt|radiosity|transport|lightfield] [--targets .1,.05,.02] [SCENE.glb ...]
// The two demo scenes when none is named.
// One JSON line a bake: target, how it ended, certified interval, independent error, seconds, passes. Asserts nothing.
// Scenes are lit by their own lamps and by the built-in clear sky (order 6, so that the target bounds transport), light
// fields by the courtyard.

#include <cstdio>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client_cli/models.h"
#include "core/artifact/baked_scene.h"
#include "core/artifact/links_glb.h"
#include "core/bake/bake.h"
#include "core/bake/certificate.h"
#include "core/bake/demo_scene.h"
#include "core/bake/job_light.h"
#include "core/bake/light_field_certificate.h"
#include "core/bake/links_certificate.h"
#include "tests/core/bake/output_file.h"

namespace kiln {
namespace {

using nlohmann::json;

struct Named {
  std::string name;
  SceneFiles files;
};

std::vector<double> parse_targets(const std::string& text) {
  std::vector<double> out;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t used = 0;
    out.push_back(std::stod(text.substr(at), &used));
    at += used + 1;
  }
  return out;
}

using testing::file;

constexpr std::uint64_t kManyRays = 4'000'000'000, kOtherSeed = 4711;

/// Transport, radiance towards eyes, or reflected light of lamps, at points of its own.
ErrorStats judge_again(const BakeInput& input, const Bytes& glb, const BakedScene& decoded, Threads& threads) {
  const auto scene = import_scene(input.scene, {});
  const Tracer truth(*scene, threads);
  const auto light = *job_light(input);
  if (input.recipe.transport) {
    const auto links = read_links(glb, decoded);
    const LinksCheck check{.decoded = decoded,
                           .links = *links,
                           .builder = nullptr,
                           .truth = truth,
                           .bake_rays = kManyRays / 4,
                           .seed = kOtherSeed};
    return certify_links(check, threads).of_rms;
  }
  if (!input.recipe.light_field)
    return certify(decoded, truth, light, {.bake_rays = kManyRays, .seed = kOtherSeed}, threads).transport;
  return certify_field({decoded, truth, light, kManyRays, kOtherSeed}, threads).radiance;
}

void measure(const Named& scene, const std::string& step, double target, Threads& threads) {
  const bool field = step == "lightfield";
  json steps = json::array({{{"do", step}}});
  if (step == "prt") steps[0]["order"] = 6;
  const json recipe = {{"environment", {{"builtin", field ? "courtyard" : "clear"}}},
                       {"quality", {{"target_error", target}}},
                       {"steps", steps}};
  BakeInput input{scene.files, *parse_recipe(recipe.dump()), {}, {}};
  const std::clock_t start = std::clock();
  const auto output = bake(input, {}, threads);
  if (!output) {
    std::printf("%s\n", json{{"scene", scene.name}, {"target", target}, {"fault", output.error().code}}.dump().c_str());
    return;
  }
  const json report = json::parse(file(*output, "report.json"));
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  const ErrorStats other = judge_again(input, file(*output, "scene.glb"), *decoded, threads);
  const bool links = step == "transport";
  const json& certificate = (field ? report["lightfield"] : links ? report["links"] : report)["certificate"];
  std::printf("%s\n", json{{"scene", scene.name},
                           {"target", target},
                           {"ended_by", report["promise"]["ended_by"]},
                           {"certified", certificate[links ? "of_rms" : "relrmse"]},
                           {"interval", certificate[links ? "of_rms_interval" : "interval"]},
                           {"independent", other.relrmse},
                           {"independent_interval", {other.interval_low, other.interval_high}},
                           {"seconds", report["seconds"]},
                           {"processor_seconds", static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC},
                           {"passes", report["promise"]["passes"].size()},
                           {"pass_list", report["promise"]["passes"]},
                           {"reason", report["promise"]["reason"]},
                           {"triangles", report["result"]["triangles"]},
                           {"bytes", report["result"]["bytes"]}}
                          .dump()
                          .c_str());
  std::fflush(stdout);
}

int run(int count, char** words) {
  std::vector<double> targets = {0.1, 0.05, 0.02};
  std::vector<Named> scenes;
  std::string step = "prt";
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--targets" && i + 1 < count) {
      targets = parse_targets(words[++i]);
      continue;
    }
    if (word == "--step" && i + 1 < count) {
      step = words[++i];
      continue;
    }
    auto files = load_files(word);
    if (!files) {
      std::fprintf(stderr, "%s: %s\n", word.c_str(), files.error().problem.detail.c_str());
      return 1;
    }
    scenes.push_back({std::filesystem::path(word).stem().string(), std::move(*files)});
  }
  for (const std::string& name : scenes.empty() ? demo_scene_names() : std::vector<std::string>{}) {
    scenes.push_back({name, {}});
    scenes.back().files.name = name + ".glb";
    scenes.back().files.main = *demo_scene(name);
  }
  Threads threads;
  for (const Named& scene : scenes) {
    for (const double target : targets) measure(scene, step, target, threads);
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run(count, words); }
