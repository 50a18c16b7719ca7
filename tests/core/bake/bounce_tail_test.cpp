#include "core/bake/bounce_tail.h"

#include <gtest/gtest.h>

#include "core/bake/plan.h"
#include "tests/core/trace/test_scenes.h"

namespace kiln {
namespace {

/// A room without a ceiling: light comes in, and is lost again where it went in.
Scene open_room(float albedo) {
  Scene scene;
  test::add_room(scene, 0.4F, test::add_material(scene, {albedo, albedo, albedo}));
  Mesh& mesh = scene.mesh;
  mesh.triangles.erase(mesh.triangles.begin() + 6, mesh.triangles.begin() + 8);  // looks down from y = .4
  mesh.part.erase(mesh.part.begin() + 6, mesh.part.begin() + 8);
  return scene;
}

std::string reason_for_bounces(const Scene& scene) {
  Threads threads;
  for (const Decision& d : make_plan(scene, {}, effort_of(Quality::finest), threads).decisions)
    if (d.decision == "bounces") return d.reason;
  return {};
}

TEST(BounceTail, GrowsWithTheAlbedo) {
  Threads threads;
  int before = 0;
  for (const float albedo : {0.2F, 0.5F, 0.8F, 1.0F}) {
    const Scene scene = open_room(albedo);
    const BounceTail tail = measure_bounces(Tracer(scene, threads), false, 0.0005, threads);
    EXPECT_GT(tail.bounces, before) << albedo;
    EXPECT_LE(tail.left, 0.0005) << albedo;
    before = tail.bounces;
  }
}

TEST(BounceTail, ThePlanSaysThatWallsAreWhiterThanPaint) {
  EXPECT_NE(reason_for_bounces(open_room(1)).find("100 % of the surface is whiter than any paint"), std::string::npos);
  EXPECT_EQ(reason_for_bounces(open_room(0.8F)).find("whiter"), std::string::npos);
}

}  // namespace
}  // namespace kiln
