// What light transport must keep on every scene: a constant sky gives values from 0 to 1, an occluder taken away never
// darkens, and no more light leaves than comes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/artifact/baked_scene.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/interreflection.h"
#include "core/prt/subdivide.h"
#include "tests/core/extremes/random_scene.h"
#include "tests/core/extremes/seeds.h"

namespace kiln::test {
namespace {

constexpr float kY00 = 0.28209479F;

int below(Random& random, int n) { return static_cast<int>(random.next() % static_cast<std::uint64_t>(n)); }

struct Extremes {
  float low = 0, high = 0;
};

/// Of the light of a constant sky of 1 over all vertices and channels.
Extremes constant_sky(const Transfer& t) {
  Extremes e{1e30F, -1e30F};
  for (std::size_t v = 0; v < t.vertices(); ++v) {
    for (int c = 0; c < t.channels; ++c) {
      const float value = t.at(v, c)[0] / kY00;
      EXPECT_TRUE(std::isfinite(value));
      e = {std::min(e.low, value), std::max(e.high, value)};
    }
  }
  return e;
}

TEST(TransferProperty, AConstantSkyGivesValuesFromNoneToOneAtEveryStage) {
  Threads threads(2);
  for_seeds(1000, [&](std::uint64_t seed) {
    std::optional<Scene> scene = imported(random_scene(seed));
    if (!scene) return;
    Random random(seed, 1);
    const int order = 1 + below(random, 4), samples = 16 << below(random, 4);
    Subdivided split;
    {
      const Tracer tracer(*scene, threads);
      const DirectTransferBaker baker(tracer, {.order = order, .samples = samples, .seed = seed});
      const auto width = static_cast<std::size_t>(sh_count(order));
      const auto values = [&](std::span<const TransferPoint> points) {
        std::vector<float> rows = baker.bake(points, threads);
        for (std::size_t i = 0; i < rows.size(); i += width) {
          EXPECT_GE(rows[i] / kY00, 0);
          EXPECT_LE(rows[i] / kY00, 1 + 1e-6F);  // rounding of Y00
        }
        return rows;
      };
      const std::uint64_t budget = scene->mesh.triangles.size() * static_cast<std::uint64_t>(below(random, 4));
      split = subdivide(scene->mesh, {width, values, {0}, hidden_test(tracer)},
                        {.measure = static_cast<SplitMeasure>(below(random, 4)), .triangles = budget}, threads);
    }
    scene->mesh = split.mesh;
    const Tracer tracer(*scene, threads);
    BakedScene baked;
    const int bounces = below(random, 6);
    baked.transfer = bake_interreflection(
        tracer, scene->mesh, std::move(split.values), {},
        {.order = order, .bounces = bounces, .samples = samples, .seed = seed, .stand_ins = split.stand_ins}, threads);
    const Extremes solved = constant_sky(baked.transfer);
    // Rows are rounded to 2^-13 of their largest number while the mesh splits, to 2e-5 of t_0 while light is reflected.
    EXPECT_GE(solved.low, -2.5e-4F);
    EXPECT_LE(solved.high, 1 + 2.5e-4F);

    baked.scene = std::move(*scene);
    const Result<Bytes> file = write_baked_glb(baked, {.transfer = {.bits = 8 + below(random, 9)}});
    ASSERT_TRUE(file) << file.error().message;
    const Result<BakedScene> decoded = read_baked_glb(*file);
    ASSERT_TRUE(decoded) << decoded.error().message;
    const Extremes delivered = constant_sky(decoded->transfer);
    EXPECT_GE(delivered.low, solved.low - 1e-6F);  // the grid of a slot reaches from its least to its largest value
    EXPECT_LE(delivered.high, solved.high + 1e-6F);
  });
}

/// The scene without the triangles of one part; vertices stay, so all points keep their names and rays.
Scene without_part(const Scene& scene, std::uint32_t part) {
  Scene out = scene;
  out.mesh.triangles.clear(), out.mesh.part.clear();
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.mesh.part[t] == part) continue;
    out.mesh.triangles.push_back(scene.mesh.triangles[t]);
    out.mesh.part.push_back(scene.mesh.part[t]);
  }
  return out;
}

bool emits(const Scene& scene, std::uint32_t part) {
  return !(scene.materials[static_cast<std::size_t>(scene.parts[part].material)].emission == Vec3f{});
}

/// The tracer's rounding decides of rays along edges, and of which of two faces in one plane is met; it is another
/// with another tree. README of core/trace: less than one ray in a hundred thousand.
struct Darkened {
  std::uint64_t points = 0, rays = 0;  // points that got darker, rays that all points sent

  void expect_few() const { EXPECT_LE(static_cast<double>(points), 1 + 1e-5 * static_cast<double>(rays)); }
};

TEST(TransferProperty, RemovingAnOccluderNeverDarkens) {
  Threads threads(2);
  Darkened sky, lamps;
  for_seeds(1500, [&](std::uint64_t seed) {
    const std::optional<Scene> scene = imported(random_scene(seed));
    if (!scene) return;
    const auto gone = static_cast<std::uint32_t>(mix64(seed) % scene->parts.size());
    const Scene less = without_part(*scene, gone);
    const std::vector<TransferPoint> points = vertex_points(scene->mesh);
    const Tracer all(*scene, threads), fewer(less, threads);
    const DirectTransfer params{.order = 1, .samples = 64, .seed = seed};
    const std::vector<float> before = bake_direct_transfer(all, points, params, threads),
                             after = bake_direct_transfer(fewer, points, params, threads);
    sky.rays += points.size() * 64;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (after[v] < before[v] - 1e-6F) ++sky.points;
      EXPECT_GE(after[v], before[v] - 3.01F / 64 * kY00) << "vertex " << v;  // three rays of one vertex
    }
    if (emits(*scene, gone)) return;
    const FixedDirect params_of_lamps{.samples = 32, .seed = seed};
    const std::vector<Vec3f> lit = bake_fixed_direct(all, points, params_of_lamps, threads),
                             brighter = bake_fixed_direct(fewer, points, params_of_lamps, threads);
    lamps.rays += points.size() * (32 + 8);
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (brighter[v].x + brighter[v].y + brighter[v].z < (lit[v].x + lit[v].y + lit[v].z) * (1 - 1e-5F))
        ++lamps.points;
    }
  });
  sky.expect_few();
  lamps.expect_few();
}

TEST(TransferProperty, NoMoreLightLeavesThanComes) {
  // K reflects at most rho of what comes, at every vertex and pass: D <= T_k <= D + max D (rho + ... + rho^k).
  Threads threads(2);
  for_seeds(1000, [&](std::uint64_t seed) {
    std::optional<Scene> scene = imported(random_scene(seed, {.lamps = false}));
    if (!scene) return;
    Random random(seed, 2);
    std::vector<Vec3f> direct;
    const float strength = std::pow(10.0F, 16 * random.uniform() - 8);
    for (std::size_t v = 0; v < scene->mesh.position.size(); ++v) {
      direct.push_back(Vec3f{random.uniform(), random.uniform(), random.uniform()} * strength);
    }
    const Tracer tracer(*scene, threads);
    const int bounces = 1 + below(random, 6);
    const Transfer t = bake_interreflection(tracer, scene->mesh, std::vector<float>(direct.size(), 0.0F), direct,
                                            {.order = 1, .bounces = bounces, .samples = 32, .seed = seed}, threads);
    const auto reflections = static_cast<float>(bounces);  // albedo is at most .999
    for (std::size_t v = 0; v < direct.size(); ++v) {
      for (int c = 0; c < 3; ++c) {
        const float own = direct[v][static_cast<std::size_t>(c)], value = t.at(v, c)[1];
        ASSERT_GE(value, own * (1 - 1e-6F)) << v;
        ASSERT_LE(value, own + strength * reflections * (1 + 1e-5F)) << v;
      }
    }
  });
}

}  // namespace
}  // namespace kiln::test
