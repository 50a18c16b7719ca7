// Points on surfaces: what a Poisson-disk distribution promises.

#include "core/meshless/points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/mesh/topology.h"
#include "core/meshless/cover.h"
#include "core/sphere/sampling.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

PointHierarchy place(const Scene& scene, const PointPlacement& params, int thread_count = 2) {
  Threads threads(thread_count);
  const Tracer tracer(scene, threads);
  const GatherFaces faces(scene);
  return place_points(tracer, faces, params, threads);
}

/// How far q's disk lets p come, as a multiple of R: distance over the cosine of the normals.
float scaled_distance(const SurfaceSite& p, const SurfaceSite& q) {
  const float cosine = dot(p.normal, q.normal);
  return cosine > 0 ? length(p.position - q.position) / cosine : 1e9F;
}

/// The level of each point.
std::vector<std::size_t> level_of(const PointHierarchy& h) {
  std::vector<std::size_t> out;
  for (std::size_t level = 0; level < h.levels(); ++level) out.resize(h.level_end[level], level);
  return out;
}

void expect_distances_kept(const PointHierarchy& h) {
  const std::vector<std::size_t> level = level_of(h);
  for (std::size_t i = 0; i < h.points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const SurfaceSite &a = h.points[i].site, &b = h.points[j].site;
      // i came later and is of the finer level: its radius was in force. A rounding of the product is left.
      if (a.group != b.group) continue;
      ASSERT_GE(scaled_distance(a, b), h.radius[level[i]] * (1 - 1e-5F)) << i << " " << j;
    }
  }
}

/// Of random places on the mesh the share that is farther than `factor` R from every compatible point.
double uncovered(const Scene& scene, const PointHierarchy& h, float factor, int samples = 4000) {
  const float radius = h.radius.back() * factor;
  const double area = surface_area(scene.mesh);
  int open = 0;
  for (int s = 0; s < samples; ++s) {
    Random random(77, static_cast<std::uint64_t>(s));
    double pick = random.uniform_double() * area;
    std::size_t t = 0;
    for (; t + 1 < scene.mesh.triangles.size(); ++t) {
      pick -= triangle_area(scene.mesh, scene.mesh.triangles[t]);
      if (pick < 0) break;
    }
    const Triangle& corner = scene.mesh.triangles[t];
    const Vec2<double> uv = uniform_triangle({random.uniform_double(), random.uniform_double()});
    const auto u = static_cast<float>(uv.x), v = static_cast<float>(uv.y);
    const auto mix = [&](const std::vector<Vec3f>& x) {
      return x[corner[0]] * (1 - u - v) + x[corner[1]] * u + x[corner[2]] * v;
    };
    const SurfaceSite p{mix(scene.mesh.position), normalized(mix(scene.mesh.normal))};
    const bool covered = std::any_of(h.points.begin(), h.points.end(),
                                     [&](const MeshlessPoint& q) { return scaled_distance(p, q.site) < radius; });
    open += covered ? 0 : 1;
  }
  return static_cast<double>(open) / samples;
}

Scene floor_scene() {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 3, 3);
  return scene;
}

Scene sphere_scene() {
  Scene scene = testing::empty_scene();
  testing::add_sphere(scene, {}, 0.4F, 24);
  return scene;
}

TEST(MeshlessPoints, KeepTheirDistanceOnEveryLevel) {
  for (const Scene& scene : {floor_scene(), sphere_scene(), testing::room_scene()}) {
    const PointHierarchy h = place(scene, {.levels = 3, .wanted = 1500});
    ASSERT_EQ(h.levels(), 3U);
    EXPECT_FLOAT_EQ(h.radius[1], h.radius[0] / 2);
    EXPECT_GT(h.points.size(), 800U);
    expect_distances_kept(h);
  }
}

TEST(MeshlessPoints, CoverTheSurface) {
  for (const Scene& scene : {floor_scene(), sphere_scene()}) {
    const PointHierarchy h = place(scene, {.levels = 4, .wanted = 2000});
    // What kProposals leave open: a gap of g R^2 is missed with probability exp(-12 g). .005 was measured.
    EXPECT_LT(uncovered(scene, h, 1), 0.008);
    EXPECT_EQ(uncovered(scene, h, 1.5F), 0);
  }
}

TEST(MeshlessPoints, AutoRadiusGivesAboutTheWantedNumber) {
  for (const Scene& scene : {floor_scene(), sphere_scene()}) {
    const auto count = static_cast<double>(place(scene, {.wanted = 4000}).points.size());
    EXPECT_GT(count, 4000 * 0.8);
    EXPECT_LT(count, 4000 * 1.25);
  }
}

TEST(MeshlessPoints, EachLevelHasAboutFourTimesThePointsOfAllBefore) {
  const PointHierarchy h = place(floor_scene(), {.levels = 4, .wanted = 8000});
  for (std::size_t level = 2; level < h.levels(); ++level) {
    const double ratio = static_cast<double>(h.level_end[level]) / h.level_end[level - 1];
    EXPECT_NEAR(ratio, 4, 0.8) << level;  // borders: a disk at the rim covers less
  }
}

TEST(MeshlessPoints, AreTheSameForAnyThreadCount) {
  const Scene scene = testing::knot_scene();
  const PointHierarchy one = place(scene, {.wanted = 3000, .seed = 5}, 1),
                       three = place(scene, {.wanted = 3000, .seed = 5}, 3);
  ASSERT_EQ(one.points.size(), three.points.size());
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    EXPECT_EQ(one.points[i].site.position, three.points[i].site.position);
    EXPECT_EQ(one.points[i].triangle, three.points[i].triangle);
  }
  const PointHierarchy other = place(scene, {.wanted = 3000, .seed = 6});
  EXPECT_FALSE(other.points[0].site.position == one.points[0].site.position);
}

TEST(MeshlessPoints, LieOnTheirTriangles) {
  const Scene scene = testing::knot_scene();
  for (const MeshlessPoint& p : place(scene, {.wanted = 1000}).points) {
    const Triangle& t = scene.mesh.triangles[p.triangle];
    const Vec3f face = area_vector(scene.mesh, t);
    EXPECT_NEAR(dot(normalized(face), p.site.position - scene.mesh.position[t[0]]), 0, 1e-6);
    EXPECT_GE(p.u, 0);
    EXPECT_GE(p.v, 0);
    EXPECT_LE(p.u + p.v, 1 + 1e-6F);
    EXPECT_GT(dot(p.site.normal, p.face_normal), 0);
    EXPECT_NEAR(length(p.site.normal), 1, 1e-5);
  }
}

TEST(MeshlessPoints, StayOutOfSolids) {
  // A box stands on the floor: the floor under it is inside the solid.
  Scene scene = floor_scene();
  testing::add_box(scene, {-0.2F, 0, -0.2F}, {0.2F, 0.4F, 0.2F}, 1, false);
  std::size_t under = 0, top = 0;
  for (const MeshlessPoint& p : place(scene, {.wanted = 3000}).points) {
    const Vec3f x = p.site.position;
    const bool inside = std::abs(x.x) < 0.2F && std::abs(x.z) < 0.2F;
    under += inside && x.y == 0 && p.site.normal.y > 0 ? 1 : 0;
    top += inside && x.y > 0.39F ? 1 : 0;
  }
  EXPECT_EQ(under, 0U);
  EXPECT_GT(top, 50U);
}

TEST(MeshlessPoints, CoverBothSheetsThatLieBackToBack) {
  // Two sheets a hair apart that look away from each other: neither refuses the other's points.
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  testing::add_grid(scene, {-0.5F, -1e-6F, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1, 1);
  std::size_t up = 0, down = 0;
  for (const MeshlessPoint& p : place(scene, {.wanted = 2000}).points) (p.site.normal.y > 0 ? up : down) += 1;
  EXPECT_NEAR(static_cast<double>(up), static_cast<double>(down), 150);
  EXPECT_GT(up, 700U);
}

TEST(MeshlessPoints, ShareCoincidentSheetsThatLookTheSameWay) {
  Scene scene = floor_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 3, 3);
  const PointHierarchy twice = place(scene, {.radius = 0.1F, .levels = 2}),
                       once = place(floor_scene(), {.radius = 0.1F, .levels = 2});
  expect_distances_kept(twice);
  EXPECT_NEAR(static_cast<double>(twice.points.size()), static_cast<double>(once.points.size()),
              0.1 * static_cast<double>(once.points.size()));
}

TEST(MeshlessPoints, InAGapAreAGroupOfTheirOwn) {
  // A floor and a double-sided sheet over its middle, nearer than half of the finest R: whatever is below the sheet
  // stands apart from what is beside it, on both sides of the gap and as densely as in the open.
  Scene scene = floor_scene();
  const std::uint32_t sheet = testing::add_part(scene, {1, 1, 1}, true);
  testing::add_grid(scene, {-0.25F, 0.02F, 0.25F}, {0.5F, 0, 0}, {0, 0, -0.5F}, 1, 1, sheet);
  const PointHierarchy h = place(scene, {.radius = 0.1F, .levels = 2});
  EXPECT_FLOAT_EQ(h.cover, 0.05F);
  std::size_t below = 0, back = 0, beside = 0;
  for (const MeshlessPoint& p : h.points) {
    const Vec3f& x = p.site.position;
    const bool inside = std::max(std::abs(x.x), std::abs(x.z)) < 0.25F;
    EXPECT_EQ(p.site.group, p.behind || (inside && x.y < 0.01F) ? kCoveredGroup : kOpenGroup);
    if (p.behind) ++back;
    if (x.y < 0.01F) ++(inside ? below : beside);
  }
  expect_distances_kept(h);
  // Three quarters of the floor lie beside; some 75 points on the quarter below, at random to about their root.
  EXPECT_NEAR(static_cast<double>(below), static_cast<double>(beside) / 3, 0.2 * static_cast<double>(below));
  EXPECT_NEAR(static_cast<double>(back), static_cast<double>(below), 0.2 * static_cast<double>(below));
}

TEST(MeshlessPoints, StandOnTheSideThatVerticesHaveLightFor) {
  Scene scene = testing::empty_scene();
  const std::uint32_t sheet = testing::add_part(scene, {1, 1, 1}, true);
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1, sheet);
  for (Triangle& t : scene.mesh.triangles) std::swap(t[1], t[2]);  // the winding says down, the normals say up
  for (const MeshlessPoint& p : place(scene, {.wanted = 200}).points) EXPECT_GT(p.face_normal.y, 0);
}

TEST(MeshlessPoints, OfDegenerateAndTinyScenes) {
  Scene none = testing::empty_scene();
  EXPECT_TRUE(place(none, {}).points.empty());

  Scene flat = testing::empty_scene();
  flat.mesh.position = {{0, 0, 0}, {0.5F, 0, 0}, {0.25F, 0, 0}};
  flat.mesh.normal = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  flat.mesh.triangles = {{0, 1, 2}};
  flat.mesh.part = {0};
  EXPECT_TRUE(place(flat, {}).points.empty());  // no area

  Scene one = testing::empty_scene();
  one.mesh.position = {{0, 0, 0}, {0, 0, 0.01F}, {0.01F, 0, 0}};
  one.mesh.normal = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  one.mesh.triangles = {{0, 1, 2}};
  one.mesh.part = {0};
  const PointHierarchy wide = place(one, {.radius = 50, .levels = 2});
  EXPECT_EQ(wide.points.size(), 1U);  // a radius larger than the scene
  EXPECT_EQ(wide.level_end, (std::vector<std::uint32_t>{1, 1}));
  EXPECT_GT(place(one, {.wanted = 100}).points.size(), 50U);
}

TEST(MeshlessPoints, SurviveNormalsThatContradictTheirFaces) {
  Scene scene = sphere_scene();
  for (std::size_t v = 0; v < scene.mesh.normal.size(); ++v) {
    Random random(9, v);
    scene.mesh.normal[v] = to_float(uniform_sphere({random.uniform_double(), random.uniform_double()}));
  }
  const PointHierarchy h = place(scene, {.levels = 2, .wanted = 500});
  EXPECT_GT(h.points.size(), 300U);
  expect_distances_kept(h);
}

}  // namespace
}  // namespace kiln
