// A grid baked from reduced geometry against one from the whole model: Pacanowski et al. 2006, section 5.
//   kiln_reduced_grid draft|standard|final FILE...
// Each under an overcast sky, 32 vertices along each side, with a tenth and a hundredth of the triangles; `seed`
// is what two bakes of the whole model differ by. One JSON line a case: CIELAB delta E over the whole model's surface.

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

  Result<Grid> grid(const std::string& before, int seed) const {
    const std::string recipe = R"({"steps":[)" + before + R"({"do":"grid","resolution":[32,32,32]}],"quality":")" +
                               quality + R"(","certificate":false,"environment":{"builtin":"overcast"},"seed":)" +
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
  KILN_TRY(whole, baker.grid("", 0));
  const auto report = [&](const char* what, const Grid& other) {
    const testing::ShadingDifference d = testing::shading_difference(tracer, whole, other);
    const nlohmann::ordered_json line = {{"bench", "reduced_grid"},
                                         {"file", path},
                                         {"quality", quality},
                                         {"triangles", scene.mesh.triangles.size()},
                                         {"case", what},
                                         {"mean", d.mean},
                                         {"p99", d.p99}};
    std::puts(line.dump().c_str());
    std::fflush(stdout);
  };
  KILN_TRY(again, baker.grid("", 1));
  report("seed", again);
  KILN_TRY(tenth, baker.grid(R"({"do":"reduce","ratio":0.1},)", 0));
  report("a tenth", tenth);
  KILN_TRY(hundredth, baker.grid(R"({"do":"reduce","ratio":0.01},)", 0));
  report("a hundredth", hundredth);
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
