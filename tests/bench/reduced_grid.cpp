// A grid baked from reduced geometry against one from the whole model: Pacanowski et al. 2006, section 5.
//   kiln_reduced_grid FILE...
// Each under an overcast sky, 32 vertices along each side, with a tenth and a hundredth of the triangles; `seed`
// is what two bakes of the whole model differ by. One JSON line a case: CIELAB delta E over the whole model's surface.

#include <cstdio>
#include <string>

#include "core/artifact/grid_exr.h"
#include "core/bake/bake.h"
#include "tests/core/bake/bake_input.h"
#include "tests/core/bake/shading_difference.h"

namespace kiln::bench {
namespace {

Result<Grid> grid_of(const SceneFiles& files, const std::string& before, int seed, Threads& threads) {
  BakeInput input{.scene = files};
  const std::string recipe = R"({"steps":[)" + before +
                             R"({"do":"grid","resolution":[32,32,32]}],"quality":"draft","certificate":false,)" +
                             R"("environment":{"builtin":"overcast"},"seed":)" + std::to_string(seed) + "}";
  input.recipe = *parse_recipe(recipe);
  KILN_TRY(output, bake(input, {}, threads));
  return read_grid_exr(testing::file(output, "grid.exr"), "grid.exr");
}

Result<bool> run(const std::string& path, Threads& threads) {
  KILN_TRY(files, read_scene_files(path));
  KILN_TRY(scene, import_scene(files));
  const Tracer tracer(scene, threads);
  KILN_TRY(whole, grid_of(files, "", 0, threads));
  const auto report = [&](const char* what, const Grid& other) {
    const testing::ShadingDifference d = testing::shading_difference(tracer, whole, other);
    std::printf(
        "{\"bench\":\"reduced_grid\",\"file\":\"%s\",\"triangles\":%zu,\"case\":\"%s\",\"mean\":%.3f,\"p99\":%.3f}\n",
        path.c_str(), scene.mesh.triangles.size(), what, d.mean, d.p99);
    std::fflush(stdout);
  };
  KILN_TRY(again, grid_of(files, "", 1, threads));
  report("seed", again);
  KILN_TRY(tenth, grid_of(files, R"({"do":"reduce","ratio":0.1},)", 0, threads));
  report("a tenth", tenth);
  KILN_TRY(hundredth, grid_of(files, R"({"do":"reduce","ratio":0.01},)", 0, threads));
  report("a hundredth", hundredth);
  return true;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  kiln::Threads threads(2);
  for (int i = 1; i < argc; ++i) {
    const auto done = kiln::bench::run(argv[i], threads);
    if (!done) std::fprintf(stderr, "%s: %s\n", argv[i], done.error().message.c_str());
  }
}
