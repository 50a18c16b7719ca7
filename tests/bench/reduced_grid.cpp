// A grid baked from reduced geometry against one from the whole model: Pacanowski et al. 2006, section 5.
//   kiln_reduced_grid draft|standard|final FILE...
// Each under an overcast sky, 16 vertices along each side, 2048 rays a vertex, with a tenth of the triangles; `seed` is
// what two bakes of the whole model differ by. All light (what the surface looks like) and reflected light alone, both
// shown at half of white. One JSON line a case: CIELAB delta E over the whole model's surface.

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "core/artifact/grid_exr.h"
#include "core/bake/bake.h"
#include "tests/core/bake/bake_input.h"
#include "tests/core/bake/shading_difference.h"

namespace kiln::bench {
namespace {

struct Baker {
  const SceneFiles& files;
  std::string quality;
  Threads& threads;

  Result<Grid> grid(const std::string& content, const std::string& before, int seed) const {
    const std::string recipe =
        R"({"steps":[)" + before + R"({"do":"grid","resolution":[16,16,16],"samples":2048,"content":")" + content +
        R"("}],"quality":")" + quality + R"(","certificate":false,"environment":{"builtin":"overcast"},"seed":)" +
        std::to_string(seed) + "}";
    const auto parsed = parse_recipe(recipe);
    if (!parsed) return fault("no_recipe", parsed.error().front().detail);
    BakeInput input{.scene = files};
    input.recipe = *parsed;
    KILN_TRY(output, bake(input, {}, threads));
    return read_grid_exr(testing::file(output, "grid.exr"), "grid.exr");
  }
};

Result<bool> run(const std::string& path, const std::string& quality, Threads& threads) {
  KILN_TRY(files, read_scene_files(path));
  KILN_TRY(scene, import_scene(files));
  const Tracer tracer(scene, threads);
  const Baker baker{files, quality, threads};
  for (const char* content : {"all", "indirect"}) {
    KILN_TRY(whole, baker.grid(content, "", 0));
    const auto report = [&](const char* what, const Grid& other) {
      const testing::ShadingDifference d = testing::shading_difference(tracer, whole, other);
      const nlohmann::ordered_json line = {
          {"bench", "reduced_grid"}, {"file", path}, {"quality", quality}, {"triangles", scene.mesh.triangles.size()},
          {"content", content},      {"case", what}, {"mean", d.mean},     {"p99", d.p99}};
      std::puts(line.dump().c_str());
      std::fflush(stdout);
    };
    KILN_TRY(again, baker.grid(content, "", 1));
    report("seed", again);
    KILN_TRY(tenth, baker.grid(content, R"({"do":"reduce","ratio":0.1},)", 0));
    report("a tenth", tenth);
  }
  return true;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  kiln::Threads threads(2);
  for (int i = 2; i < argc; ++i) {
    const auto done = kiln::bench::run(argv[i], argv[1], threads);
    if (!done) std::fprintf(stderr, "%s: %s\n", argv[i], done.error().message.c_str());
  }
}
