// White furnaces at every albedo: the baked solver, and the path tracer at the brightest.
//
// A closed room whose walls give E = 1 each has the value 1 / (1 - rho). What seams let through (direct_transfer_test:
// at most 3.5e-4 of the rays of a vertex on them) is lost at every reflection: 1 / (1 - rho (1 - 3.5e-4)) at least.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/bake/bake.h"
#include "core/prt/interreflection.h"
#include "core/trace/reference.h"
#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/extremes/random_bake.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln::test {
namespace {

constexpr double kSeams = 3.5e-4;

struct Room {
  float albedo = 0;
  bool round = false;
};

Scene closed_room(const Room& room) {
  Scene scene = kiln::testing::empty_scene();
  const std::uint32_t part = kiln::testing::add_part(scene, {room.albedo, room.albedo, room.albedo});
  if (room.round) {
    kiln::testing::add_sphere(scene, {0.01F, 0.02F, 0}, 0.45F, 12, part);
    for (Triangle& t : scene.mesh.triangles) std::swap(t[1], t[2]);
    for (Vec3f& n : scene.mesh.normal) n = -n;
  } else {
    kiln::testing::add_box(scene, {-0.41F, -0.37F, -0.5F}, {0.43F, 0.35F, 0.5F}, 3, true, part);
  }
  return scene;
}

/// Every vertex's value after `bounces` passes, when each has 1 of its own.
std::vector<float> furnace(const Room& room, int bounces) {
  const Scene scene = closed_room(room);
  Threads threads(1);  // thousands of passes over a hundred vertices
  const Tracer tracer(scene, threads);
  const std::size_t count = scene.mesh.position.size();
  const Transfer t =
      bake_interreflection(tracer, scene.mesh, std::vector<float>(count, 0.0F), std::vector<Vec3f>(count, {1, 1, 1}),
                           {.order = 1, .bounces = bounces, .samples = 64}, threads);
  std::vector<float> out;
  for (std::size_t v = 0; v < count; ++v) out.push_back(t.at(v, 0)[1]);
  return out;
}

double mean(const std::vector<float>& values) {
  double sum = 0;
  for (const float x : values) sum += x;
  return sum / static_cast<double>(values.size());
}

TEST(Furnace, RoomsReachOneOverOneMinusAlbedo) {
  for (const double rho : {0.5, 0.9, 0.99, 0.999}) {
    const int bounces = static_cast<int>(std::lround(7 / (1 - rho)));  // e^-7 is left: 9e-4
    const std::vector<float> values = furnace({.albedo = static_cast<float>(rho)}, bounces);
    const double truth = 1 / (1 - rho), least = 1 / (1 - rho * (1 - kSeams)) * (1 - std::exp(-7.0));
    EXPECT_GE(mean(values), least) << rho;
    EXPECT_LE(*std::max_element(values.begin(), values.end()), truth * (1 + 1e-4)) << rho;  // float sums
  }
}

TEST(Furnace, SmoothWallsLoseNoLightBetweenTheirFacets) {
  // A sphere's facets meet at angles that no ray slips through; what is lost is taken for a back at grazing angles.
  for (const double rho : {0.5, 0.9, 0.99}) {
    const int bounces = static_cast<int>(std::lround(7 / (1 - rho)));
    const double value = mean(furnace({.albedo = static_cast<float>(rho), .round = true}, bounces));
    // Within 0.006 degrees of grazing: 2 sin(7.5 degrees) 1e-4 rad of a vertex's rays at the facets beside it, 3e-5.
    EXPECT_GE(value * (1 - rho), (1 - rho) / (1 - rho * (1 - 3e-5)) - 1e-3) << rho;
  }
}

TEST(Furnace, AlbedoOneIsTakenFor999Thousandths) {
  EXPECT_EQ(furnace({.albedo = 1}, 50), furnace({.albedo = 0.999F}, 50));
  EXPECT_EQ(furnace({.albedo = 5}, 50), furnace({.albedo = 0.999F}, 50));
}

TEST(Furnace, AlbedoNoneIsDirectLightAlone) {
  for (const float x : furnace({.albedo = 0}, 5)) EXPECT_EQ(x, 1);
}

TEST(Furnace, ThePathTracerAgreesAt999Thousandths) {
  // Emission 1 - rho: the value is 1. The mean path has 1000 reflections.
  Scene scene = closed_room({.albedo = 0.999F});
  scene.materials.back().emission = {0.001F, 0.001F, 0.001F};
  std::vector<ReferencePoint> points;
  for (const float x : {-0.2F, 0.1F, 0.25F}) points.push_back({{x, -0.37F, 0.1F}, {0, 1, 0}, {0, 1, 0}});
  Threads threads(2);
  const Tracer tracer(scene, threads);
  const ReferenceResult r = trace_reference(tracer, points, {.scene_lights = true}, {.samples = 400}, threads);
  double value = 0, difference = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    value += r.value[i].x / 3;
    difference += std::pow((r.half_a[i].x - r.half_b[i].x) / 2, 2) / 9;
  }
  // Paths of geometric length: standard error 1 / sqrt(1200); seams take 1e-5 of the rays from inside faces.
  EXPECT_NEAR(value, 1, 4 / std::sqrt(1200.0) + 0.01);
  EXPECT_LT(difference, 0.01);
}

}  // namespace
}  // namespace kiln::test
