// What merging saves: scenes baked to one target with it, as planned, and without.
//   kiln_merge [--target .03] [--pictures DIR] SCENE ...
// One JSON line a bake: vertices, bytes, processor seconds, certified error and its interval, and the independent error
// at other points of the input. Overcast sky, order 6, no matrices. A model without normals, which glTF shades flat,
// gets smooth ones: facets are edges of light, and nothing of them can merge.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/artifact/baked_scene.h"
#include "core/bake/bake.h"
#include "core/bake/certificate.h"
#include "core/bake/job_light.h"
#include "core/mesh/topology.h"
#include "tests/bench/bench.h"
#include "tests/core/bake/output_file.h"

namespace kiln {
namespace {

using nlohmann::json;

/// The triangles of a mesh with normals averaged at each position.
SceneFiles smooth(const Mesh& mesh) {
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  std::vector<Vec3f> normal(place.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) normal[place[v]] += area_vector(mesh, t);
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex " << place.size() << '\n';
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) text << "property float " << name << '\n';
  text << "element face " << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  text.precision(9);
  for (std::size_t v = 0; v < place.size(); ++v) {
    const Vec3f &p = mesh.position[v], n = normalized(normal[v], Vec3f{0, 1, 0});
    text << p.x << ' ' << p.y << ' ' << p.z << ' ' << n.x << ' ' << n.y << ' ' << n.z << '\n';
  }
  for (const Triangle& t : mesh.triangles)
    text << "3 " << place[t[0]] << ' ' << place[t[1]] << ' ' << place[t[2]] << '\n';
  const std::string bytes = text.str();
  return {.name = "smooth.ply", .main = Bytes(bytes.begin(), bytes.end())};
}

using testing::file;

struct Job {
  std::string name;
  SceneFiles files;
  double target = 0.03;
  std::string pictures;
};

void measure(const Job& job, const std::string& merge, Threads& threads) {
  const json recipe = {{"environment", {{"builtin", "overcast"}}},
                       {"quality", {{"target_error", job.target}}},
                       {"steps", {{{"do", "prt"}, {"order", 6}, {"glossy", "off"}, {"merge", merge}}}}};
  const BakeInput input{.scene = job.files, .recipe = *parse_recipe(recipe.dump())};
  const double before = bench::process_seconds();
  const auto output = bake(input, {}, threads);
  const double seconds = bench::process_seconds() - before;
  if (!output) {
    std::printf("%s\n", json{{"scene", job.name}, {"fault", output.error().message}}.dump().c_str());
    return;
  }
  const json report = json::parse(file(*output, "report.json"));
  if (!job.pictures.empty()) {
    const Bytes& picture = file(*output, "preview.png");
    std::ofstream(job.pictures + "/" + job.name + "-" + merge + ".png", std::ios::binary)
        .write(reinterpret_cast<const char*>(picture.data()), static_cast<std::streamsize>(picture.size()));
  }
  const auto scene = import_scene(input.scene, {});
  const auto decoded = read_baked_glb(file(*output, "scene.glb"));
  const Tracer truth(*scene, threads);
  const Certificate other = certify(*decoded, truth, *job_light(input), {.thorough = true, .seed = 4711}, threads);
  json line = {{"scene", job.name},
               {"merge", merge},
               {"input_vertices", report["scene"]["vertices"]},
               {"vertices", report["result"]["vertices"]},
               {"bytes", report["result"]["bytes"]},
               {"processor_s", seconds},
               {"ended_by", report["promise"]["ended_by"]},
               {"passes", report["promise"]["passes"].size()},
               {"relrmse", report["certificate"]["relrmse"]},
               {"interval", report["certificate"]["interval"]},
               {"independent", other.transport.relrmse},
               {"predicted_vertices", report["prediction"]["vertices"]}};
  if (report.contains("merge")) line["merged"] = report["merge"];
  for (const json& d : report["plan"])
    if (d["decision"] == "merge") line["plan"] = d["reason"];
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  using namespace kiln;
  Threads threads;
  Job job;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--target" && i + 1 < argc) {
      job.target = std::stod(argv[++i]);
    } else if (word == "--pictures" && i + 1 < argc) {
      job.pictures = argv[++i];
    } else {
      job.name = std::filesystem::path(word).stem().string();
      const auto files = read_scene_files(word);
      const auto scene = files ? import_scene(*files, {}) : Result<Scene>(tl::make_unexpected(files.error()));
      if (!scene) return std::fprintf(stderr, "%s: %s\n", word.c_str(), scene.error().message.c_str()), 1;
      const bool flat = scene->mesh.position.size() == 3 * scene->mesh.triangles.size();
      job.files = flat ? smooth(scene->mesh) : *files;
      for (const char* merge : {"auto", "off"}) measure(job, merge, threads);
    }
  }
}
