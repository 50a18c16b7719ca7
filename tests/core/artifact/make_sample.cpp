// kiln-make-sample OUT.glb [ORDER [CHANNELS]]               a sphere over a plane as a baked scene
// kiln-make-sample --components OUT.glb [ORDER [CHANNELS]]  the same, stored as weights of 16 components
// kiln-make-sample --lightmap OUT.glb [ORDER [CHANNELS]]    all of it, with a lightmap and points
// kiln-make-sample --everything OUT.glb [ORDER [CHANNELS]]  all that the format can carry
// kiln-make-sample --reduced OUT.glb [MAP]                  a coloured ball of 10,800 triangles in 1000, with maps of
// MAP texels kiln-make-sample --import SCENE.gltf OUT.glb              a scene as if under an open sky, without a bake

#include <cmath>
#include <cstdio>
#include <fstream>
#include <span>
#include <string>

#include "core/artifact/points_glb.h"
#include "core/artifact/reduced_glb.h"
#include "core/reduce/reduce.h"
#include "tests/core/artifact/sample_scene.h"
#include "tests/core/reduce/models.h"

namespace {

int number_or(std::span<char*> arguments, std::size_t at, int absent) {
  return at < arguments.size() ? std::stoi(arguments[at]) : absent;
}

int write_file(const char* path, const kiln::Result<kiln::Bytes>& file) {
  if (!file) {
    std::fprintf(stderr, "%s\n", file.error().message.c_str());
    return 65;
  }
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(file->data()), static_cast<std::streamsize>(file->size()));
  return out.good() ? 0 : 73;
}

int write_sample(const char* path, const kiln::BakedScene& scene, const kiln::Encoding& encoding = {}) {
  return write_file(path, kiln::write_baked_glb(scene, encoding));
}

/// Without regard to where texture coordinates lie.
kiln::Result<kiln::Bytes> with_lightmap_and_points(const kiln::BakedScene& scene) {
  KILN_TRY(plain, kiln::write_baked_glb(scene));
  const std::size_t parts = scene.scene.parts.size();
  const kiln::Lightmap map{
      .side = 16, .texels = std::vector<kiln::Vec3f>(256, {1, 0.5F, 0}), .parts = std::vector<char>(parts, 1)};
  KILN_TRY(lit, kiln::add_lightmap(plain, map, std::vector<char>(parts, 1)));
  return kiln::add_points(
      lit, {.sites = {{{0, 0, 0}, {0, 127, 0}, 0}}, .level_end = {1}, .radius = {1}, .coefficients = {{1, 2, 3}}});
}

kiln::Result<kiln::Bytes> reduced_ball(int map_side) {
  kiln::testing::Model model = kiln::testing::sphere(30);
  for (kiln::Vec3d& p : model.position) {
    model.color.push_back(kiln::to_float(p * 0.5 + kiln::Vec3d{0.5, 0.5, 0.5}));
    p = p * (1 + 0.02 * std::sin(25 * p.x) * std::sin(25 * p.y) * std::sin(25 * p.z));
  }
  const kiln::TriangleSource source = kiln::testing::source_of(model);
  kiln::Threads threads(1);
  const kiln::Reduce how{.triangles = 1000, .map_side = map_side, .begin = {}, .advance = {}};
  KILN_TRY(plan, kiln::plan_reduction(source, how));
  KILN_TRY(reduced, kiln::reduce(source, plan, how, threads));
  return kiln::write_reduced_glb(
      {.mesh = reduced.mesh, .maps = reduced.maps, .frame = reduced.frame, .name = "ball", .provenance = "{}"});
}

int import_sample(const char* scene_path, const char* out_path) {
  const auto files = kiln::read_scene_files(scene_path);
  auto scene = files ? kiln::import_scene(*files) : tl::make_unexpected(files.error());
  if (scene) return write_sample(out_path, kiln::open_sky(std::move(*scene), 3));
  std::fprintf(stderr, "%s: %s %s\n", scene.error().code.c_str(), scene.error().where.c_str(),
               scene.error().message.c_str());
  return 65;
}

}  // namespace

int main(int argc, char** argv) {
  std::span<char*> arguments(argv + 1, static_cast<std::size_t>(argc - 1));
  const std::string mode = !arguments.empty() && arguments[0][0] == '-' ? arguments[0] : "";
  if (!mode.empty()) arguments = arguments.subspan(1);
  if (arguments.size() < (mode == "--import" ? 2u : 1u)) {
    std::fputs(
        "usage: kiln-make-sample [--components | --everything | --lightmap | --reduced | --import SCENE.gltf] OUT.glb "
        "[ORDER | MAP "
        "[CHANNELS]]\n",
        stderr);
    return 64;
  }
  if (mode == "--import") return import_sample(arguments[0], arguments[1]);
  if (mode == "--reduced") return write_file(arguments[0], reduced_ball(number_or(arguments, 1, 256)));
  const int order = number_or(arguments, 1, 4), channels = number_or(arguments, 2, 3);
  if (mode == "--components") {
    const kiln::BakedScene scene = kiln::sphere_over_plane(order, channels, true);
    return write_sample(arguments[0], scene, {.transfer = kiln::as_components(scene, 16)});
  }
  if (mode == "--lightmap")
    return write_file(arguments[0], with_lightmap_and_points(kiln::everything(order, channels)));
  return write_sample(arguments[0], mode == "--everything" ? kiln::everything(order, channels)
                                                           : kiln::sphere_over_plane(order, channels, true));
}
