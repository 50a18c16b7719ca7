// Lamps that light fields keep apart, against what core/trace says of them.
#include "core/lightfield/lamp_highlights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "core/lightfield/collapse_cost.h"
#include "core/lightfield/field_lamp.h"
#include "core/lightfield/outgoing.h"
#include "core/lightfield/seen.h"
#include "core/lightfield/simplify.h"
#include "core/trace/ggx.h"
#include "core/trace/highlights.h"
#include "core/trace/surface_samples.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

const Vec3d kF0{0.9, 0.6, 0.3};

Light lamp(LightType type, const Vec3f& position, const Vec3f& intensity) {
  Light out{.type = type, .name = {}, .intensity = intensity, .position = position};
  out.direction = normalized(-position);
  out.inner_cone = 0.3F, out.outer_cone = 0.6F;
  return out;
}

void make_metal(Scene& scene, std::uint32_t part, float roughness) {
  Material& m = scene.materials[static_cast<std::size_t>(scene.parts[part].material)];
  m.metallic = 1, m.roughness = roughness;
}

/// A metal plate around the origin that looks up.
Scene plate(float roughness) {
  Scene scene = testing::empty_scene();
  const std::uint32_t metal = testing::add_part(scene, to_float(kF0));
  testing::add_grid(scene, {-0.4F, 0, -0.4F}, {0, 0, 0.8F}, {0.8F, 0, 0}, 6, 6, metal);
  make_metal(scene, metal, roughness);
  return scene;
}

OutgoingLight baked(const Tracer& tracer, bool apart, Threads& threads) {
  const std::vector<Vec3f> value(tracer.scene().mesh.position.size());
  const GatherFaces faces(tracer.scene());
  return bake_outgoing({tracer, faces, nullptr, nullptr}, {tracer.scene(), value},
                       {.degree = 2, .rays = 128, .lamps_apart = apart}, threads);
}

/// Largest difference between what the field and core/trace say, and the largest that core/trace says: at the middles
/// of triangles that `counts`, towards eyes around mirror directions and elsewhere.
struct Compared {
  double off = 0, largest = 0;
};
template <class Counts>
Compared compared(const Tracer& tracer, const LightField& field, double roughness, const Counts& counts) {
  const Mesh& mesh = tracer.scene().mesh;
  Compared out;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const Vec3f place = (mesh.position[t[0]] + mesh.position[t[1]] + mesh.position[t[2]]) * (1.0F / 3);
    if (!counts(t, place)) continue;
    const Vec3d normal = normalized(to_double(mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]));
    Random random(3, i);
    for (int k = 0; k < 20; ++k) {
      const Vec3d view = random_view(normal, random);
      if (dot(view, normal) < 0.01) continue;  // nearer the horizon the field raises eyes
      const Vec3d truth = punctual_highlights(
          tracer, {{place, to_float(normal), to_float(normal)}, to_float(view), ggx_alpha(roughness), kF0});
      const Vec3d shown =
          seen_radiance(field, nullptr, {t, 1.0 / 3, 1.0 / 3, normal, view, kF0, roughness, to_double(place)});
      for (std::size_t c = 0; c < 3; ++c) {
        out.off = std::max(out.off, std::abs(shown[c] - truth[c]));
        out.largest = std::max(out.largest, truth[c]);
      }
    }
  }
  return out;
}

const auto kAll = [](const Triangle&, const Vec3f&) { return true; };

TEST(LampHighlights, OnAnOpenPlateAreThoseOfTheTracerWhateverTheLamp) {
  Threads threads(2);
  for (const auto& [type, roughness] :
       {std::pair{LightType::point, 0.15F}, {LightType::spot, 0.4F}, {LightType::directional, 0.25F}}) {
    Scene scene = plate(roughness);
    scene.lights.push_back(lamp(type, {0.1F, 0.3F, -0.2F}, {2, 1, 0.5F}));
    if (type == LightType::point) scene.lights.back().range = 0.7F;
    scene.lights.push_back(lamp(LightType::point, {-0.3F, 0.4F, 0.1F}, {0, 0, 0.3F}));
    const Tracer tracer(scene, threads);
    const LightField apart = baked(tracer, true, threads).field;
    ASSERT_EQ(apart.lamps.size(), 2U);
    const Compared a = compared(tracer, apart, double{roughness}, kAll);
    // The tracer stands off the surface by an offset against acne, 1e-5 of the cube: so much nearer the lamp.
    EXPECT_LT(a.off, 1e-3 * a.largest);
    double left = 0;
    for (const float c : apart.coefficients) left = std::max(left, std::abs(double{c}));
    EXPECT_EQ(left, 0) << "nothing else is there to be seen";
  }
}

/// Why they are kept apart.
TEST(LampHighlights, AreBeyondASeries) {
  Threads threads(2);
  Scene scene = plate(0.4F);
  scene.lights.push_back(lamp(LightType::point, {0.1F, 0.3F, -0.2F}, {2, 1, 0.5F}));
  const Tracer tracer(scene, threads);
  const LightField series = baked(tracer, false, threads).field;
  EXPECT_FALSE(series.has_lamps());
  const Compared b = compared(tracer, series, 0.4, kAll);
  EXPECT_GT(b.off, 0.1 * b.largest);
}

TEST(LampHighlights, AreNotWhereNoCornerSeesTheLamp) {
  Threads threads(2);
  Scene scene = plate(0.3F);
  const std::uint32_t wall = testing::add_part(scene, {0, 0, 0}, true);
  // Stands between a lamp at the left and the right half.
  testing::add_grid(scene, {0.05F, 0, -0.5F}, {0, 0.5F, 0}, {0, 0, 1}, 1, 1, wall);
  scene.lights.push_back(lamp(LightType::point, {-0.3F, 0.2F, 0}, {1, 1, 1}));
  const Tracer tracer(scene, threads);
  const LightField field = baked(tracer, true, threads).field;
  const auto lit = [](const Triangle&, const Vec3f& p) { return p.y == 0 && p.x < -0.14F; };
  const auto dark = [](const Triangle&, const Vec3f& p) { return p.y == 0 && p.x > 0.14F; };
  const Compared seen = compared(tracer, field, 0.3, lit), hidden = compared(tracer, field, 0.3, dark);
  EXPECT_GT(seen.largest, 0.1);
  EXPECT_LT(seen.off, 1e-3 * seen.largest);
  EXPECT_EQ(hidden.largest, 0);
  EXPECT_EQ(hidden.off, 0);
}

/// Of a ball that stands alone nothing is in the way of light but itself: up to the edge of its own shadow.
TEST(LampHighlights, GoOnToTheEdgeOfASmoothSurfacesOwnShadow) {
  Threads threads(2);
  Scene scene = testing::empty_scene();
  const std::uint32_t metal = testing::add_part(scene, to_float(kF0));
  testing::add_sphere(scene, {0, 0, 0}, 0.3F, 24, metal);
  make_metal(scene, metal, 0.3F);
  scene.lights.push_back(lamp(LightType::directional, {0.3F, 1, 0.2F}, {1, 1, 1}));
  const Tracer tracer(scene, threads);
  const LightField field = baked(tracer, true, threads).field;
  const Vec3d way = -to_double(scene.lights[0].direction);
  int edges = 0;
  for (const Triangle& t : scene.mesh.triangles) {
    int facing = 0;
    for (const std::uint32_t v : t) facing += dot(to_double(scene.mesh.normal[v]), way) > 0 ? 1 : 0;
    if (facing == 0) continue;
    edges += facing < 3 ? 1 : 0;
    for (const std::uint32_t v : t) EXPECT_EQ(field.lamp_visibility[v], 1) << "vertex " << v;
  }
  EXPECT_GT(edges, 20);
}

TEST(LampHighlights, OfManyLampsTheBrightestAreApartAndTheOthersInTheSeries) {
  Threads threads(2);
  Scene scene = plate(0.6F);
  for (int k = 0; k < 11; ++k) {
    const float bright = k % 4 == 1 ? 1e-3F : 1;  // numbers 1, 5 and 9
    const float x = -0.4F + 0.08F * static_cast<float>(k);
    scene.lights.push_back(lamp(LightType::point, {x, 0.3F, 0}, Vec3f{bright, bright, bright}));
    scene.lights.back().range = 1 + static_cast<float>(k);  // a name for it
  }
  const Tracer tracer(scene, threads);
  const LightField field = baked(tracer, true, threads).field;
  ASSERT_EQ(field.lamps.size(), kMostFieldLamps);
  std::vector<float> named;
  for (const FieldLamp& l : field.lamps) named.push_back(l.light.range - 1);
  EXPECT_EQ(named, (std::vector<float>{0, 2, 3, 4, 6, 7, 8, 10}));
  const auto any = [](float c) { return c != 0; };
  EXPECT_TRUE(std::ranges::any_of(field.coefficients, any)) << "what the faint ones send";
  const Compared c = compared(tracer, field, 0.6, kAll);
  EXPECT_LT(c.off, 3e-3 * c.largest);  // faint ones are a thousandth of the bright ones, and ring
}

/// Mean over the sphere of the square of a blurred highlight, against quadrature of the lobe itself.
TEST(LampHighlights, DistancesSeeALobeOfTheRightSize) {
  const FieldLamp made = make_field_lamp(lamp(LightType::directional, {0, 1, 0}, {1, 1, 1}), {1, 1, 1});
  double sum = 0, all = 0, squares = 0;
  for (int i = 0; i < 4000; ++i) {
    const double a = std::numbers::pi * (i + 0.5) / 4000, weight = std::sin(a);
    sum += weight * std::pow(ggx_cosine(0.15, {0, 0, 1}, {std::sin(a), 0, std::cos(a)}), 2), all += weight;
  }
  for (const float c : made.lobe) squares += double{c} * double{c} / (4 * std::numbers::pi);
  EXPECT_NEAR(squares, sum / all, 1e-3 * sum / all);  // 1024 steps of quadrature
  // Along +y it is brightest: the direction to the lamp.
  const auto along = [&](const Vec3d& w) {
    std::array<double, kVisibilityCount> y{};
    evaluate_sh(kVisibilityOrder, w, y.data());
    double out = 0;
    for (std::size_t i = 0; i < y.size(); ++i) out += double{made.lobe[i]} * y[i];
    return out;
  };
  EXPECT_GT(along({0, 1, 0}), 4 * std::abs(along({1, 0, 0})));
}

/// Of a sheet that is flat and of one colour only shadows keep vertices.
TEST(LampHighlights, ShadowsOfLampsKeepVerticesAndBentMirrorsDo) {
  Threads threads(1);
  const auto left = [&](float turn, bool shadow) {
    LitMesh lit;
    constexpr std::uint32_t kSide = 21;
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
      const float x = static_cast<float>(i % kSide) / kSide - 0.5F, z = static_cast<float>(i / kSide) / kSide - 0.5F;
      lit.mesh.position.push_back({x, 0, z});
      lit.mesh.normal.push_back(normalized(Vec3f{turn * std::sin(12 * x), 1, 0}));
      lit.field.lamp_visibility.push_back(shadow && std::hypot(x, z) < 0.2F ? 0.0F : 1.0F);
      if (i % kSide == 0 || i < kSide) continue;
      lit.mesh.triangles.push_back({i - kSide - 1, i - 1, i});
      lit.mesh.triangles.push_back({i - kSide - 1, i, i - kSide});
    }
    lit.mesh.part.assign(lit.mesh.triangles.size(), 0);
    lit.field.degree = 2;
    lit.field.coefficients.resize(27 * lit.mesh.position.size());
    for (std::size_t v = 0; v < lit.mesh.position.size(); ++v)
      for (std::size_t c = 0; c < 3; ++c) lit.field.of(v)[9 * c] = 1;
    lit.field.lamps.push_back(make_field_lamp(lamp(LightType::point, {0, 0.4F, 0}, {1, 1, 1}), {1, 1, 1}));
    const SimplifyResult result = simplify(std::move(lit), {.max_error = 0.02}, threads);
    EXPECT_EQ(result.lit.field.lamp_visibility.size(), result.lit.mesh.position.size());
    EXPECT_EQ(result.lit.field.lamps.size(), 1U);
    return result.lit.mesh.triangles.size();
  };
  const std::size_t even = left(0, false), shadowed = left(0, true), bent = left(0.2F, false);
  std::printf("triangles left of 800: %zu even, %zu shadowed, %zu bent\n", even, shadowed, bent);
  EXPECT_LT(even, 20U);
  EXPECT_GT(shadowed, 3 * even);
  EXPECT_GT(bent, 3 * even);
}

}  // namespace
}  // namespace kiln
