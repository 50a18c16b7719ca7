// Merging before splitting: fewer vertices for the same light, judged on the surface of the input.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/artifact/baked_scene.h"
#include "core/bake/certificate.h"
#include "core/bake/job_light.h"
#include "core/bake/merge_plan.h"
#include "core/mesh/closest_point.h"
#include "tests/core/bake/bake_input.h"

namespace kiln {
namespace {

using nlohmann::json;
using testing::file;
using testing::input_of;
using testing::report_of;

/// Rows of x y z nx ny nz r g b and faces, as a PLY.
struct Ply {
  std::ostringstream vertices, faces;
  int vertex_count = 0, face_count = 0;

  int vertex(const Vec3f& p, const Vec3f& n, const Vec3f& color = {200, 200, 200}) {
    vertices << p.x << ' ' << p.y << ' ' << p.z << ' ' << n.x << ' ' << n.y << ' ' << n.z << ' ' << int(color.x) << ' '
             << int(color.y) << ' ' << int(color.z) << '\n';
    return vertex_count++;
  }
  void face(int a, int b, int c) {
    faces << "3 " << a << ' ' << b << ' ' << c << '\n';
    ++face_count;
  }
  /// n x n squares from `origin` along u and v, facing u x v.
  template <class Height, class Color>
  void sheet(int n, const Vec3f& origin, const Vec3f& u, const Vec3f& v, const Height& height, const Color& color) {
    const Vec3f up = normalized(cross(u, v));
    const auto place = [&](float x, float y) { return origin + u * x + v * y + up * height(x, y); };
    const int first = vertex_count;
    constexpr float kStep = 1e-3F;
    for (int i = 0; i <= n; ++i) {
      for (int k = 0; k <= n; ++k) {
        const float x = static_cast<float>(k) / static_cast<float>(n),
                    y = static_cast<float>(i) / static_cast<float>(n);
        const Vec3f normal =
            normalized(cross(place(x + kStep, y) - place(x - kStep, y), place(x, y + kStep) - place(x, y - kStep)));
        vertex(place(x, y), normal, color(x, y));
      }
    }
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < n; ++k) {
        const int at = first + i * (n + 1) + k;
        face(at, at + 1, at + n + 2);
        face(at, at + n + 2, at + n + 1);
      }
    }
  }
  BakeInput input(const std::string& recipe) const {
    const std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertex_count) +
                             "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
                             "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
                             "property uchar blue\nelement face " +
                             std::to_string(face_count) + "\nproperty list uchar int vertex_indices\nend_header\n" +
                             vertices.str() + faces.str();
    BakeInput input;
    input.scene.name = "fine.ply";
    input.scene.main = Bytes(text.begin(), text.end());
    input.recipe = *parse_recipe(recipe);
    return input;
  }
};

float level(float, float) { return 0; }
Vec3f grey(float, float) { return {200, 200, 200}; }

/// A finely tessellated floor of shallow hills with a box of fine faces on it.
Ply fine_box_on_hills() {
  Ply ply;
  ply.sheet(
      64, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4},
      [](float x, float y) { return 0.05F * std::sin(7 * x) * std::cos(5 * y) - 0.1F; }, grey);
  const Vec3f low{-0.5F, -0.2F, -0.5F};
  const Vec3f x{1, 0, 0}, y{0, 1.2F, 0}, z{0, 0, 1};
  ply.sheet(16, low + y, z, x, level, grey);  // up
  ply.sheet(16, low + x, y, z, level, grey), ply.sheet(16, low, z, y, level, grey);
  ply.sheet(16, low + z, x, y, level, grey), ply.sheet(16, low, y, x, level, grey);
  return ply;
}

std::string recipe_of(const std::string& merge, const std::string& more = R"(,"quality":"draft")") {
  return R"({"environment":{"builtin":"overcast"},"steps":[{"do":"prt","order":4,"merge":")" + merge + "\"}]" + more +
         "}";
}

BakeOutput baked(const BakeInput& input, int threads_used = 0) {
  Threads threads(threads_used);
  auto output = bake(input, {}, threads);
  EXPECT_TRUE(output) << output.error().message;
  return std::move(*output);
}

/// relRMSE of a delivered file against the input's surface, at other points than the bake's certificate.
double independent_error(const BakeInput& input, const BakeOutput& output) {
  Threads threads;
  const auto scene = import_scene(input.scene, {});
  const auto decoded = read_baked_glb(file(output, "scene.glb"));
  const Tracer truth(*scene, threads);
  return certify(*decoded, truth, *job_light(input), {.thorough = true, .seed = 99}, threads).transport.relrmse;
}

const json* decision(const json& report, const std::string& name) {
  for (const json& d : report["plan"])
    if (d["decision"] == name) return &d;
  return nullptr;
}

std::size_t size_of(const BakeOutput& output) { return file(output, "scene.glb").size(); }

TEST(Merge, AFineSceneComesBackWithFewerVerticesAndTheSameLight) {
  const Ply ply = fine_box_on_hills();
  const BakeInput with = ply.input(recipe_of("auto")), without = ply.input(recipe_of("off"));
  const BakeOutput merged = baked(with), whole = baked(without);
  const json a = report_of(merged), b = report_of(whole);
  EXPECT_LT(a["merge"]["triangles"].get<double>(), 0.5 * a["merge"]["input_triangles"].get<double>());
  EXPECT_FALSE(b.contains("merge"));
  EXPECT_LT(a["result"]["vertices"], b["result"]["vertices"]);
  EXPECT_LT(static_cast<double>(size_of(merged)), 0.9 * static_cast<double>(size_of(whole)));
  // The promise about shape, in parts of the diagonal, and of light: what the quality allows merging.
  EXPECT_LE(a["merge"]["distance_max"].get<double>(), a["parameters"]["merge_reach"].get<double>());
  EXPECT_LE(a["merge"]["error"].get<double>(), a["parameters"]["merge_error"].get<double>());
  // Squares add up; estimates are good to a third, and certificates spread by what their intervals say.
  const double allowed = a["parameters"]["merge_error"].get<double>();
  const double wide = b["certificate"]["interval"][1].get<double>() - b["certificate"]["relrmse"].get<double>();
  const double bound = std::hypot(b["certificate"]["relrmse"].get<double>(), 1.3 * allowed) + wide;
  EXPECT_LT(a["certificate"]["relrmse"].get<double>(), bound);
  EXPECT_LT(independent_error(with, merged), bound);
}

TEST(Merge, ACoarseInputIsLeftAndThePlanSaysWhy) {
  const json report = report_of(baked(input_of("column", recipe_of("auto"))));
  const json* merge = decision(report, "merge");
  ASSERT_TRUE(merge != nullptr);
  EXPECT_EQ((*merge)["value"], "no");
  EXPECT_NE((*merge)["reason"].get<std::string>().find("coarse"), std::string::npos) << *merge;
  EXPECT_FALSE(report.contains("merge"));
}

TEST(Merge, WhatThePlanSkipsIsNotWorthMuch) {
  // Forced, the column scene loses less than two fifths of its triangles: what the plan counts as coarse.
  const json forced = report_of(baked(input_of("column", recipe_of("on"))));
  EXPECT_EQ((*decision(forced, "merge"))["reason"], "asked for by the recipe");
  EXPECT_GT(forced["merge"]["triangles"].get<double>(), 0.6 * forced["merge"]["input_triangles"].get<double>());
}

TEST(Merge, GivesTheSameBytesOnAnyNumberOfThreads) {
  const BakeInput input = fine_box_on_hills().input(recipe_of("on"));
  EXPECT_EQ(file(baked(input, 1), "scene.glb"), file(baked(input, 2), "scene.glb"));
}

TEST(Merge, ATargetIsMetOnTheInputsSurface) {
  const BakeInput input = fine_box_on_hills().input(recipe_of("on", R"(,"quality":{"target_error":0.05})"));
  const BakeOutput output = baked(input);
  const json report = report_of(output);
  EXPECT_EQ(report["promise"]["ended_by"], "target_met") << report["promise"];
  EXPECT_GT(report["merge"]["error"].get<double>(), 0);
  EXPECT_LE(report["error_sources"]["merging"].get<double>(), 0.05 / 4);  // as noise may have of the first pass
  EXPECT_LE(independent_error(input, output), 0.05);
}

TEST(Merge, ColoursOfVerticesStayWhereTheyAre) {
  // A sharp disc of paint on an even plane: light has no use for its vertices.
  Ply ply;
  const auto disc = [](float x, float y) {
    return std::hypot(x - 0.5F, y - 0.5F) < 0.3F ? Vec3f{250, 40, 40} : Vec3f{40, 40, 250};
  };
  ply.sheet(80, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, level, disc);
  const BakeInput input = ply.input(recipe_of("on"));
  const BakeOutput output = baked(input);
  EXPECT_LT(report_of(output)["merge"]["triangles"].get<double>(), 0.5 * 80 * 80 * 2);
  const auto scene = import_scene(input.scene, {});
  const auto decoded = read_baked_glb(file(output, "scene.glb"));
  const ClosestPoint nearest(decoded->scene.mesh);
  std::size_t wrong = 0;
  const Mesh& before = scene->mesh;
  for (std::size_t v = 0; v < before.position.size(); ++v) {
    const auto at = nearest.query(to_double(before.position[v]), {});
    const Triangle& t = decoded->scene.mesh.triangles[at->triangle];
    const double weight[] = {1 - at->u - at->v, at->u, at->v};
    double red = 0;
    for (std::size_t k = 0; k < 3; ++k) red += weight[k] * double{decoded->scene.mesh.color[t[k]].x};
    wrong += std::abs(red - double{before.color[v].x}) > 0.1;
  }
  EXPECT_LT(wrong, before.position.size() / 50);  // a fifth of those along the circle
}

TEST(Merge, BadTrianglesAndLoneVerticesDoNotDisturbIt) {
  Ply ply;
  ply.sheet(40, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, level, grey);
  const int lone = ply.vertex({0, 3, 0}, {0, 1, 0}), a = ply.vertex({0, 1, 0}, {1, 0, 0});
  ply.vertex({0.2F, 3, 0}, {0, 1, 0});  // of no triangle
  ply.face(0, 0, 1), ply.face(5, 6, 5), ply.face(3, 4, 44), ply.face(3, 4, 44);
  ply.face(100, 101, a), ply.face(101, 100, a), ply.face(100, 101, lone);  // five faces on an edge
  const BakeOutput output = baked(ply.input(recipe_of("on")));
  const json report = report_of(output);
  EXPECT_LT(report["merge"]["triangles"].get<double>(), 1000);  // of 3200 and a few
  EXPECT_TRUE(read_baked_glb(file(output, "scene.glb")));
}

TEST(MergePlan, APlaneNeedsTwoTrianglesWhateverItHas) {
  Ply ply;
  ply.sheet(60, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, level, grey);
  const auto scene = import_scene(ply.input(recipe_of("auto")).scene, {});
  EXPECT_EQ(triangles_for_shape(scene->mesh, 1e-4), 2U);
}

TEST(MergePlan, FacetsStay) {
  Ply ply;  // of a cylinder: each square has normals of its own
  constexpr int kRound = 60, kHigh = 10;
  for (int i = 0; i < kRound; ++i) {
    const auto at = [](double turn) {
      return Vec3f{static_cast<float>(std::cos(turn)), 0, static_cast<float>(std::sin(turn))};
    };
    const Vec3f a = at(2 * M_PI * i / kRound), b = at(2 * M_PI * (i + 1) / kRound);
    ply.sheet(1, a, b - a, {0, 1, 0}, level, grey);
    for (int k = 1; k < kHigh; ++k) ply.sheet(1, a + Vec3f{0, float(k), 0}, b - a, {0, 1, 0}, level, grey);
  }
  const auto scene = import_scene(ply.input(recipe_of("auto")).scene, {});
  // All, but for corners that six digits of text leave apart.
  EXPECT_GT(static_cast<double>(triangles_for_shape(scene->mesh, 0.1)), 0.9 * 2 * kRound * kHigh);
}

TEST(MergePlan, NeededTrianglesGoAsOneOverTheReach) {
  Ply ply;
  ply.sheet(
      100, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, [](float x, float y) { return 0.2F * (x * x + y * y); }, grey);
  const auto scene = import_scene(ply.input(recipe_of("auto")).scene, {});
  const auto few = static_cast<double>(triangles_for_shape(scene->mesh, 1e-3)),
             many = static_cast<double>(triangles_for_shape(scene->mesh, 1e-4));
  EXPECT_NEAR(many / few, 10, 0.5);  // but for the rounding up
  EXPECT_LT(many, 20000);
}

}  // namespace
}  // namespace kiln
