// Size, place, flatness, odd scales and depth of the file leave light as it is: from bytes to a form factor.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "core/prt/direct_transfer.h"
#include "core/prt/interreflection.h"
#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

constexpr double kPi = std::numbers::pi;

/// A floor of 1 x 1 around the origin with a vertex in its middle, and a square lamp of radiance 4 facing down on it.
struct LampScene {
  float size = 1;          // of everything
  float lamp = 0.5;        // half side and height of the lamp, in sizes
  Vec3f stretch{1, 1, 1};  // of the coordinates in the file; the node takes it back
};

std::string number(double x) {
  std::array<char, 40> out{};
  std::snprintf(out.data(), out.size(), "%.17g", x);
  return out.data();
}

std::string matrix(const Vec3d& scale, const Vec3d& move) {
  return "\"scale\":[" + number(scale.x) + "," + number(scale.y) + "," + number(scale.z) + "],\"translation\":[" +
         number(move.x) + "," + number(move.y) + "," + number(move.z) + "]";
}

/// Nodes from the root down; the last carries both meshes. Their product must take `stretch` back but for a similarity.
Result<Scene> import_lamp(const LampScene& p, const std::vector<std::string>& nodes) {
  Sample s;
  const auto add = [&](std::vector<float> xyz) {
    for (std::size_t i = 0; i < xyz.size(); ++i) xyz[i] *= p.size * p.stretch[i % 3];
    return s.positions(xyz);
  };
  const float h = 0.5F, a = p.lamp;
  add({0, 0, 0, -h, 0, h, h, 0, h, h, 0, -h, -h, 0, -h});
  s.indices({0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1});
  add({-a, a, -a, a, a, -a, a, a, a, -a, a, a});
  s.indices({0, 1, 2, 0, 2, 3});
  std::string chain;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool last = i + 1 == nodes.size();
    chain += (i > 0 ? ",{" : "{") + nodes[i] + (nodes[i].empty() ? "" : ",") +
             (last ? "\"mesh\":0}" : "\"children\":[" + std::to_string(i + 1) + "]}");
  }
  return import_bytes(s.glb(
      "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.5,0.5,1]}},{\"emissiveFactor\":[1,1,1],"
      "\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":4}}}],"
      "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":0},"
      "{\"attributes\":{\"POSITION\":2},\"indices\":3,\"material\":1}]}],\"nodes\":[" +
      chain + "],\"scenes\":[{\"nodes\":[0]}],\"scene\":0"));
}

/// The lamp's light at the middle of the floor, and the sky's there under a constant sky of 1.
struct Middle {
  double lamp = -1, sky = -1;
};

Middle middle_of(const Scene& scene) {
  Threads threads(1);
  const Tracer tracer(scene, threads);
  // The floor's first vertices are unshared corners of the first triangle: the middle is the first of them.
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  const auto first = std::span(points).first(1);
  const std::vector<float> sky = bake_direct_transfer(tracer, first, {.order = 1, .samples = 4096}, threads);
  return {bake_fixed_direct(tracer, first, {.samples = 4096}, threads)[0].x, sky[0] * std::sqrt(4 * kPi)};
}

void expect_right(const Result<Scene>& scene, const std::string& what) {
  ASSERT_TRUE(scene) << what << ": " << scene.error().message;
  ASSERT_EQ(scene->mesh.triangles.size(), 6U) << what;
  const Middle middle = middle_of(*scene);
  // A square at a height of half its side: four corners at 1, 1 (Hamilton 1952).
  const double factor = 4 * 2 / std::sqrt(2) * std::atan(1 / std::sqrt(2)) / (2 * kPi);
  EXPECT_NEAR(middle.lamp / 4, factor, 0.01) << what;  // 1024 cosine rays at worst: 0.5 / 1024^0.75, three of them
  EXPECT_NEAR(middle.sky, 1 - factor, 4e-3) << what;   // 4096 rays: 1e-3
}

TEST(Size, ScenesFromAMicronToAMillionKilometresAreLitAlike) {
  for (const float size : {1e-6F, 1e-3F, 1.0F, 1e3F, 1e6F, 1e9F}) {
    expect_right(import_lamp({.size = size}, {""}), "size " + number(size));
  }
}

TEST(Size, TenMillionUnitsFromTheOriginADetailOfOneThousandthIsLitRight) {
  // A lamp of 1e-3 at a height of 5e-4 over a floor of 1: in world coordinates of floats all of it would be one point.
  for (const Vec3d& place : {Vec3d{1e7, 0, 0}, Vec3d{1e7, 1e7, -1e7}, Vec3d{0, -1e7, 3}}) {
    expect_right(import_lamp({.lamp = 5e-4F}, {matrix({1, 1, 1}, place)}), "place " + number(place.x));
  }
}

TEST(Size, OddScalesThatTakeEachOtherBackChangeNothing) {
  expect_right(import_lamp({}, {matrix({-1, 1, 1}, {})}), "mirrored");
  expect_right(import_lamp({}, {matrix({-2, 2, -2}, {1, 2, 3})}), "mirrored twice");
  expect_right(import_lamp({}, {matrix({1, 1, -1e-4}, {}), matrix({1, 1, 1e4}, {})}), "there and back, mirrored");
  expect_right(import_lamp({.stretch = {1e-4F, 1, 1e4F}}, {matrix({1e4, 1, 1e-4}, {})}), "stretched");
  expect_right(import_lamp({.stretch = {1e3F, 1, 1}}, {matrix({-1e-3, 1, 1}, {})}), "stretched and mirrored");
}

TEST(Size, AThousandNodesDeepTheLightIsTheSame) {
  // Each node turns by 0.36 degrees and moves; a thousand turn once.
  const double half = kPi / 1000;
  std::vector<std::string> nodes(999, "\"rotation\":[0," + number(std::sin(half)) + ",0," + number(std::cos(half)) +
                                          "],\"translation\":[1,0.5,0]");
  nodes.emplace_back("");
  expect_right(import_lamp({}, nodes), "deep");
}

TEST(Size, AFlatSceneIsOpenToTheSky) {
  for (const char* node : {"\"scale\":[1,0,1]", "\"scale\":[1,1e-9,1]"}) {
    Sample s;
    s.positions({0, 0, 0, 1, 0, 0, 1, 0, -1, 0, 0, -1});
    s.indices({0, 1, 2, 0, 2, 3});
    const Result<Scene> scene = import_bytes(s.glb(one_node("\"attributes\":{\"POSITION\":0},\"indices\":1", node)));
    ASSERT_TRUE(scene) << scene.error().message;
    const Middle middle = middle_of(*scene);
    EXPECT_NEAR(middle.sky, 1, 1e-6);
    EXPECT_EQ(middle.lamp, 0);
  }
}

}  // namespace
}  // namespace kiln::test
