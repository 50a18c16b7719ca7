// Shading normals that leave their faces: no light leaks in, no black rims come out.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/prt/direct_transfer.h"
#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln::test {
namespace {

constexpr float kY00 = 0.28209479F;

std::vector<float> under_constant_sky(const Scene& scene, int samples) {
  Threads threads(2);
  const Tracer tracer(scene, threads);
  std::vector<float> out =
      bake_direct_transfer(tracer, vertex_points(scene.mesh), {.order = 1, .samples = samples}, threads);
  for (float& x : out) x /= kY00;
  return out;
}

TEST(Normals, TheSkyBelowTheFaceIsNotSeen) {
  // A normal that leans by t from an endless floor's sees (1 + cos t) / 2 of its own hemisphere above the floor.
  for (const double degrees : {0.0, 10.0, 45.0, 75.0, 85.0, 89.0}) {
    const double lean = degrees * 3.14159265358979 / 180;
    Scene scene = kiln::testing::empty_scene();
    kiln::testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 2, 2);
    for (Vec3f& n : scene.mesh.normal) n = to_float(Vec3d{std::sin(lean), std::cos(lean), 0});
    // Vertex 4 is in the middle, the floor ends 0.5 away: 1.9e-6 / 0.5. 4096 rays: 1e-3.
    EXPECT_NEAR(under_constant_sky(scene, 4096)[4], (1 + std::cos(lean)) / 2, 3e-3) << degrees;
  }
}

TEST(Normals, NoLightLeaksIntoARoomWhoseNormalsAreRandom) {
  Scene scene = kiln::testing::empty_scene();
  kiln::testing::add_box(scene, {-0.41F, -0.37F, -0.5F}, {0.43F, 0.35F, 0.5F}, 4, true);
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Scene room = scene;
    for (std::size_t v = 0; v < room.mesh.normal.size(); ++v) {
      Random random(seed, v);
      const Vec3f n = normalized(Vec3f{random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F});
      // As the importer leaves them: on the front of their face.
      const Vec3f face = scene.mesh.normal[v];
      room.mesh.normal[v] = normalized(n - face * (2 * std::min(0.0F, dot(n, face))), face);
    }
    for (const float x : under_constant_sky(room, 256)) {
      EXPECT_LE(x, 8.0F / 256) << seed;
      sum += x, ++count;
    }
  }
  EXPECT_LE(sum / count, 1e-3);  // seams: direct_transfer_test
}

TEST(Normals, MissingZeroAndLongNormalsGiveTheLightOfTheFaces) {
  const auto light = [](const std::vector<float>& normals) {
    Sample s;
    std::vector<float> corners, expanded;
    for (const std::uint32_t i : cube_indices()) {
      for (std::size_t k = 0; k < 3; ++k) corners.push_back(cube_positions()[3 * i + k]);
    }
    s.positions(corners);
    std::string attributes = "\"POSITION\":0";
    if (!normals.empty()) {
      for (std::size_t i = 0; i < corners.size(); ++i) expanded.push_back(normals[i % normals.size()]);
      s.normals(expanded);
      attributes += ",\"NORMAL\":1";
    }
    const Result<Scene> scene = import_bytes(s.glb(one_node("\"attributes\":{" + attributes + "}")));
    if (!scene) throw std::runtime_error(scene.error().message);
    for (const Vec3f& n : scene->mesh.normal) EXPECT_NEAR(length(n), 1, 1e-6);
    return under_constant_sky(*scene, 256);
  };
  for (const float x : light({})) EXPECT_NEAR(x, 1, 1e-6);  // a convex body's faces are open
  // Normals without a direction become smooth: at the corner of a cube they lean by 55 degrees, and a face hides
  // (1 - cos 55) / 2 = .21 and no more than all three faces of the corner do: the solid angle of the cube there is an
  // eighth of the sphere, seen around the axis, where the cosine is below 0: nothing of it is hidden twice.
  for (const float x : light({0, 0, 0})) {
    EXPECT_GT(x, 0.75F);
    EXPECT_LE(x, 1 + 1e-6F);
  }
  for (const float x : light({1e-12F, 2e-12F, 0})) EXPECT_GT(x, 0.75F);  // as good as none
  for (const float x : light({1e15F, 0, 0})) {  // made unit, and mirrored to the front where it lies behind
    EXPECT_GE(x, 0.5F - 0.05F);
    EXPECT_LE(x, 1 + 1e-6F);
  }
}

}  // namespace
}  // namespace kiln::test
