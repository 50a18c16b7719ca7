// Real models to a quarter of their triangles: nothing opens and nothing folds.
#include <gtest/gtest.h>

#include <cmath>

#include "core/lightfield/simplify.h"
#include "tests/conformance/shared_models.h"
#include "tests/core/lightfield/lit_models.h"

namespace kiln {
namespace {

/// Light of a place: smooth, so that it is shape and seams that count.
LitMesh lit_model(Scene scene) {
  LitMesh lit{.mesh = std::move(scene.mesh), .field = {}};
  testing::paint(lit, 0, [](const Vec3f& p) { return Vec3f{1 + p.x, 1 + p.y, 1 + p.z}; });
  return lit;
}

struct Soundness {
  double border = 0;  // length of edges in space that have nothing on one side
  double turned = 0;  // share of the area that faces away from its vertices' normals
};
Soundness soundness(const Mesh& mesh) {
  Soundness out;
  const auto edges = testing::edges_in_space(mesh);
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    const int alone = count - (opposite == edges.end() ? 0 : opposite->second);
    if (alone > 0) out.border += alone * double{length(mesh.position[edge.first] - mesh.position[edge.second])};
  }
  for (const Triangle& t : mesh.triangles) {
    const Vec3f area = area_vector(mesh, t);
    if (dot(area, mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]) < 0)
      out.turned += double{length(area)} / 2;
  }
  out.turned /= surface_area(mesh);
  return out;
}

class ModelToAQuarter : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(SimplifyModels, ModelToAQuarter,
                         ::testing::Values("scenes/damaged-helmet/DamagedHelmet.glb", "scenes/lantern/Lantern.gltf",
                                           "scenes/lionstatue/lionstatue.glb", "scenes/skull/skull.glb",
                                           "scenes/bunny/bunny.glb", "scenes/dungeon-interior/level-dungeon.gltf",
                                           "scenes/mixed-lighting/MixedLightingExample.gltf",
                                           "conformance/CesiumMan/CesiumMan.glb",
                                           "conformance/PalmTree/PalmTree.gltf"));

TEST_P(ModelToAQuarter, NothingOpensAndNothingFolds) {
  if (!std::filesystem::exists(test::shared_models())) GTEST_SKIP() << "the shared models are not here";
  auto scene = test::import_shared(GetParam());
  ASSERT_TRUE(scene) << scene.error().message;
  const LitMesh lit = lit_model(std::move(*scene));
  Threads threads(2);
  const std::size_t quarter = lit.mesh.triangles.size() / 4;
  const SimplifyResult out = simplify(lit, {.triangles = quarter}, threads);
  testing::expect_sound(out.lit);
  const Soundness before = soundness(lit.mesh), after = soundness(out.lit.mesh);
  std::printf("%s: %zu of %zu triangles, border %.3f -> %.3f, turned %.5f -> %.5f\n", GetParam(),
              out.lit.mesh.triangles.size(), lit.mesh.triangles.size(), before.border, after.border, before.turned,
              after.turned);
  EXPECT_LE(after.border, 1.01 * before.border + 0.01);
  EXPECT_LE(after.turned, before.turned + 0.001);
}

}  // namespace
}  // namespace kiln
