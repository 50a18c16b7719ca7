// The solvers of the `prt` step against each other: vertices, then meshless at several eps_T.
//   kiln_solvers [--metal ROUGHNESS] [--eps .4,.2,.1] [--step '{"order":5,"bounces":3}'] [--quality draft] [--seeds N]
//                SCENE.glb|column|room ...
// --metal makes all of a model metal, with smooth normals of its own, and of a demo scene the knot. Under the clear
// sky, nothing merged or split unless the step says so. One JSON line a bake: matrices and vertices, processor seconds,
// rays, and the certificates of diffuse light and of radiance towards eyes; of several seeds their root mean squares.
// Asserts nothing.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/artifact/glb.h"
#include "core/artifact/reduced_glb.h"
#include "core/bake/bake.h"
#include "core/mesh/topology.h"
#include "tests/bench/bench.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;

struct Case {
  SceneFiles files;
  std::string name, quality = "standard";
  json step;
  int seeds = 1;
};

/// One mesh with smooth normals, all of it metal.
Bytes metal_of(const Scene& scene, double roughness) {
  const std::vector<std::uint32_t> place = weld_by_position(scene.mesh.position);
  std::vector<std::uint32_t> index(place.size());
  Mesh mesh;
  for (std::uint32_t v = 0; v < place.size(); ++v) {
    if (place[v] == v) mesh.position.push_back(scene.mesh.position[v]);
    index[v] = place[v] == v ? static_cast<std::uint32_t>(mesh.position.size() - 1) : index[place[v]];
  }
  mesh.normal.resize(mesh.position.size());
  for (const Triangle& t : scene.mesh.triangles) {
    mesh.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
    for (const std::uint32_t v : mesh.triangles.back()) mesh.normal[v] += area_vector(mesh, mesh.triangles.back());
  }
  for (Vec3f& n : mesh.normal) n = normalized(n, Vec3f{0, 1, 0});
  mesh.part.assign(mesh.triangles.size(), 0);
  const SurfaceMaps none;
  const Bytes plain = *write_reduced_glb({.mesh = mesh,
                                          .maps = none,
                                          .frame = {scene.frame.center, scene.frame.scale},
                                          .name = "metal",
                                          .provenance = "{}"});
  const auto chunks = split_glb(plain);
  json document = json::parse(chunks->json);
  for (json& material : document["materials"])
    material["pbrMetallicRoughness"] = {
        {"baseColorFactor", {1, 0.77, 0.34, 1}}, {"metallicFactor", 1}, {"roughnessFactor", roughness}};
  return *join_glb(document.dump(), Bytes(chunks->binary.begin(), chunks->binary.end()));
}

/// Processor seconds of each stage, by the news that a bake gives when it begins one.
class StageSeconds {
 public:
  void hear(const std::string& stage) {
    const double now = bench::process_seconds();
    if (!stage_.empty()) seconds_[stage_] += now - since_;
    stage_ = stage, since_ = now;
  }
  json per_bake(int bakes) const {
    json out = json::object();
    for (const auto& [stage, seconds] : seconds_) out[stage] = seconds / bakes;
    return out;
  }

 private:
  std::map<std::string, double> seconds_;
  std::string stage_;
  double since_ = 0;
};

/// Sums of squares become root mean squares.
struct Errors {
  double diffuse = 0, transport = 0, radiance = 0;
  void add(const json& report) {
    diffuse += std::pow(report["certificate"]["relrmse"].get<double>(), 2);
    if (!report.contains("glossy")) return;
    transport += std::pow(report["glossy"]["transport"]["relrmse"].get<double>(), 2);
    radiance += std::pow(report["glossy"]["radiance"]["relrmse"].get<double>(), 2);
  }
};

void measure(const Case& c, const json& solver, Threads& threads) {
  json step = c.step;
  step.update(solver);
  Errors errors;
  json report;
  double seconds = 0;
  StageSeconds stages;
  for (int seed = 0; seed < c.seeds; ++seed) {
    const json recipe = {{"environment", {{"builtin", "clear"}}},
                         {"quality", c.quality},
                         {"seed", seed + 1},
                         {"steps", json::array({step})}};
    const double start = bench::process_seconds();
    const auto output = bake(
        {c.files, *parse_recipe(recipe.dump()), {}, {}},
        [&stages](const ProgressEvent& news) { stages.hear(news.stage); }, threads);
    stages.hear("");
    seconds += bench::process_seconds() - start;
    if (!output) {
      std::printf("%s\n",
                  json{{"scene", c.name}, {"solver", solver}, {"fault", output.error().message}}.dump().c_str());
      return;
    }
    report = json::parse(file(*output, "report.json"));
    errors.add(report);
  }
  const auto mean = [&](double sum) { return std::sqrt(sum / c.seeds); };
  json line = {{"scene", c.name},
               {"solver", solver},
               {"vertices", report["result"]["vertices"]},
               {"cpu_s", seconds / c.seeds},
               {"rays", report["rays"]},
               {"diffuse", mean(errors.diffuse)},
               {"diffuse_interval", report["certificate"]["interval"]},
               {"predicted_s", report["prediction"]["seconds"]},
               {"bake_s", report["seconds"]},
               {"predicted_MB", report["prediction"]["memory_bytes"].get<double>() / 1e6},
               {"peak_MB", report["peak_memory_bytes"].get<double>() / 1e6},
               {"bytes", report["result"]["bytes"]},
               {"predicted_bytes", report["prediction"]["artifact_bytes"]}};
  line["cpu"] = stages.per_bake(c.seeds);
  if (report.contains("error_sources")) line["sources"] = report["error_sources"];
  if (report.contains("meshless")) line["meshless"] = report["meshless"];
  if (report.contains("glossy")) {
    const json& g = report["glossy"];
    line["glossy"] = {{"transport", mean(errors.transport)},
                      {"transport_interval", g["transport"]["interval"]},
                      {"radiance", mean(errors.radiance)},
                      {"vertices", g["vertices"]},
                      {"noise", g["noise"]},
                      {"left_out", g["compression"]}};
  }
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

int run(int count, char** words) {
  std::vector<std::string> eps = {"auto"};
  Case common;
  common.step = {{"do", "prt"}, {"merge", "off"}, {"subdivide", "off"}};
  double metal = 0;
  Threads threads;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const auto value = [&] { return std::string(i + 1 < count ? words[++i] : ""); };
    if (word == "--metal") {
      metal = std::stod(value());
    } else if (word == "--quality") {
      common.quality = value();
    } else if (word == "--seeds") {
      common.seeds = std::stoi(value());
    } else if (word == "--step") {
      common.step.update(json::parse(value()));
    } else if (word == "--eps") {
      eps.clear();
      const std::string list = value() + ",";
      for (std::size_t at = 0; at < list.size(); at = list.find(',', at) + 1)
        eps.push_back(list.substr(at, list.find(',', at) - at));
    } else {
      Case c = common;
      c.name = std::filesystem::path(word).stem().string();
      if (demo_scene(word)) {
        const json finish = {{"metallicFactor", 1}, {"roughnessFactor", metal}};
        c.files = testing::finished(word, "{}", metal > 0 ? json{{"knot", finish}} : json::object()).scene;
      } else {
        auto files = read_scene_files(word);
        if (!files) return std::fprintf(stderr, "%s: %s\n", word.c_str(), files.error().message.c_str()), 1;
        c.files = std::move(*files);
        if (metal > 0) c.files = {c.name + ".glb", metal_of(*import_scene(c.files), metal), {}};
      }
      measure(c, {{"solver", "vertices"}}, threads);
      for (const std::string& e : eps) {
        json solver = {{"solver", "meshless"}};
        if (e != "auto") solver["eps_transfer"] = std::stod(e);
        measure(c, solver, threads);
      }
    }
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run(count, words); }
