#include "core/prt/cut_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/contact_lines.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/subdivide.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

constexpr float kHalf = 0.2F;  // of the box

/// A floor from -.5 to .5 of cells x cells squares, and a box that goes through it. Its foot runs along edges where
/// `cells` is ten, and across them where it is eleven.
Scene box_in_floor(int cells, bool double_sided) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, cells, cells);
  const std::uint32_t box = testing::add_part(scene, {0.8F, 0.8F, 0.8F}, double_sided);
  testing::add_box(scene, {-kHalf, -0.1F, -kHalf}, {kHalf, 0.3F, kHalf}, 4, false, box);
  return scene;
}

Subdivided refine(const Scene& scene, std::uint64_t triangles, bool cut, Threads& threads) {
  const Tracer tracer(scene, threads);
  const DirectTransferBaker baker(tracer, {.order = 1, .samples = 1024});
  const ValueSource source{.width = 1,
                           .values = [&](std::span<const TransferPoint> p) { return baker.bake(p, threads); },
                           .bounded = {0},
                           .hidden = hidden_test(tracer)};
  const Mesh base = cut ? cut_where_light_jumps(tracer, source, triangles, threads) : scene.mesh;
  return subdivide(base, source, {.triangles = triangles}, threads);
}

TransferPoint floor_point(float x, float z) { return {{x, 0, z}, {0, 1, 0}, {x, 0, z}, {0, 1, 0}}; }

/// relRMSE of interpolated constant-band light at points of the floor that lie within .02 of the foot of the box, half
/// of them inside it.
double error_at_the_foot(int cells, bool double_sided, bool cut) {
  Threads threads(2);
  Scene scene = box_in_floor(cells, double_sided);
  std::vector<TransferPoint> places;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const float along = -0.19F + 0.38F * (static_cast<float>(i) + 0.5F) / 400, off = i % 2 == 0 ? 0.98F : 1.02F;
    const float across = kHalf * (1 + (off - 1) * static_cast<float>(1 + i % 5) / 5);
    places.push_back(i % 4 < 2 ? floor_point(along, across) : floor_point(-across, along));
  }
  const std::vector<float> truth = [&] {
    const Tracer tracer(scene, threads);
    return DirectTransferBaker(tracer, {.order = 1, .samples = 4096}).bake(places, threads);
  }();
  Subdivided fine = refine(scene, 4000, cut, threads);
  scene.mesh = std::move(fine.mesh);
  const Tracer tracer(scene, threads);
  double squares = 0, sum = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Hit hit = tracer.closest(places[i].position + Vec3f{0, 0.05F, 0}, {0, -1, 0}, 1);
    EXPECT_TRUE(hit);
    const Triangle& t = scene.mesh.triangles[hit.triangle];
    const double shown =
        (1 - hit.u - hit.v) * fine.values[t[0]] + hit.u * fine.values[t[1]] + hit.v * fine.values[t[2]];
    squares += (shown - truth[i]) * (shown - truth[i]);
    sum += truth[i];
  }
  return std::sqrt(squares * static_cast<double>(places.size())) / sum;
}

// What is left is noise of 1024 rays (.02 of a half-open point) and what a triangle cannot follow at the corners of the
// box: measured .026 and .042. Without cuts it is .86 or more.
TEST(CutLines, LightStopsAtTheFootOfABox) {
  for (const int cells : {10, 11}) {
    for (const bool double_sided : {false, true}) {
      const double with = error_at_the_foot(cells, double_sided, true);
      const double without = error_at_the_foot(cells, double_sided, false);
      EXPECT_LT(with, 0.08) << cells << (double_sided ? " double-sided" : "");
      EXPECT_GT(without, 3 * with) << cells << (double_sided ? " double-sided" : "");
    }
  }
}

using Place = std::array<float, 3>;

/// Welded edges with an odd number of triangles.
std::vector<std::pair<Vec3f, Vec3f>> odd_edges(const Mesh& mesh) {
  std::map<std::pair<Place, Place>, int> count;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f a = mesh.position[t[k]], b = mesh.position[t[(k + 1) % 3]];
      const Place p{a.x + 0.0F, a.y + 0.0F, a.z + 0.0F}, q{b.x + 0.0F, b.y + 0.0F, b.z + 0.0F};
      if (p != q) ++count[std::minmax(p, q)];
    }
  }
  std::vector<std::pair<Vec3f, Vec3f>> odd;
  for (const auto& [edge, n] : count) {
    const auto& [p, q] = edge;
    if (n % 2 == 1) odd.push_back({Vec3f{p[0], p[1], p[2]}, Vec3f{q[0], q[1], q[2]}});
  }
  return odd;
}

bool on_the_rim(const Vec3f& p) { return p.y == 0 && std::max(std::abs(p.x), std::abs(p.z)) == 0.5F; }

// A hanging vertex has three odd edges about it. The rim of the floor is all that is open here.
TEST(CutLines, CutsLeaveNoCrackAndKeepTheBudget) {
  Threads threads(2);
  for (const int cells : {10, 11}) {
    const Scene scene = box_in_floor(cells, false);
    const std::uint64_t input = scene.mesh.triangles.size();
    for (const std::uint64_t budget : {input + 1, input + 40, 2 * input, 8 * input}) {
      const Subdivided fine = refine(scene, budget, true, threads);
      EXPECT_LE(fine.mesh.triangles.size(), budget);
      EXPECT_NEAR(surface_area(fine.mesh), surface_area(scene.mesh), 1e-5 * surface_area(scene.mesh));
      for (const auto& [a, b] : odd_edges(fine.mesh)) EXPECT_TRUE(on_the_rim(a) && on_the_rim(b));
      ASSERT_EQ(fine.values.size(), fine.mesh.position.size());
      for (const float value : fine.values) EXPECT_TRUE(std::isfinite(value));
    }
  }
}

TEST(CutLines, AMeshThatNothingStandsOnIsLeftAlone) {
  Threads threads(2);
  Scene scene = testing::empty_scene();
  testing::add_sphere(scene, {0, 0, 0}, 0.4F, 24);
  const Subdivided cut = refine(scene, 4000, true, threads), plain = refine(scene, 4000, false, threads);
  EXPECT_EQ(cut.mesh.triangles, plain.mesh.triangles);
  EXPECT_EQ(cut.values, plain.values);
}

bool faces_up(const Mesh& mesh, const Triangle& t) {
  return area_vector(mesh, t).y > 0.5F * length(area_vector(mesh, t));
}

/// Two walls that cross on a floor, each of two triangles and upright, thin as they are: the floor falls into four.
TEST(CutLines, CrossedWallsPartTheFloorIntoFour) {
  Threads threads(1);
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  testing::add_grid(scene, {-0.6F, 0, 0.1F}, {1.2F, 0, 0}, {0, 0.3F, 0}, 1, 1);
  testing::add_grid(scene, {0.2F, 0, -0.6F}, {0, 0, 1.2F}, {0, 0.3F, 0}, 1, 1);
  const auto lines = find_contact_lines(scene.mesh, std::vector<bool>(6, true), threads);
  const Mesh cut = cut_along(scene.mesh, lines, 1000, threads);
  std::map<std::pair<bool, bool>, double> area;  // of the floor, by side of the walls
  for (const Triangle& t : cut.triangles) {
    if (!faces_up(cut, t)) continue;
    const Vec3f middle = centroid(cut, t);
    area[{middle.x > 0.2F, middle.z > 0.1F}] += triangle_area(cut, t);
    for (const std::uint32_t v : t) {  // whole on its side
      EXPECT_TRUE(middle.x > 0.2F ? cut.position[v].x > 0.2F - 1e-5F : cut.position[v].x < 0.2F + 1e-5F);
      EXPECT_TRUE(middle.z > 0.1F ? cut.position[v].z > 0.1F - 1e-5F : cut.position[v].z < 0.1F + 1e-5F);
    }
  }
  EXPECT_NEAR((area[{false, false}]), 0.7 * 0.6, 1e-5);
  EXPECT_NEAR((area[{true, false}]), 0.3 * 0.6, 1e-5);
  EXPECT_NEAR((area[{false, true}]), 0.7 * 0.4, 1e-5);
  EXPECT_NEAR((area[{true, true}]), 0.3 * 0.4, 1e-5);
  // No vertex is shared over a wall.
  std::map<std::uint32_t, std::pair<bool, bool>> side;
  for (const Triangle& t : cut.triangles) {
    if (!faces_up(cut, t)) continue;
    const Vec3f middle = centroid(cut, t);
    const std::pair<bool, bool> mine{middle.x > 0.2F, middle.z > 0.1F};
    for (const std::uint32_t v : t) EXPECT_EQ(side.try_emplace(v, mine).first->second, mine);
  }
}

/// A line that ends inside a face leaves the surface whole around its end.
TEST(CutLines, AWallThatEndsInsideAFloorSharesTheVertexAtItsEnd) {
  Threads threads(1);
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  testing::add_grid(scene, {-0.6F, 0, 0.1F}, {0.8F, 0, 0}, {0, 0.3F, 0}, 1, 1);
  const auto lines = find_contact_lines(scene.mesh, std::vector<bool>(4, true), threads);
  const Mesh cut = cut_along(scene.mesh, lines, 1000, threads);
  std::map<float, int> copies;  // of the places on the line, by x
  for (const Vec3f& p : cut.position) {
    if (p.y == 0 && std::abs(p.z - 0.1F) < 1e-5F) ++copies[std::round(p.x * 1000) / 1000];
  }
  EXPECT_EQ(copies[-0.5F], 3);  // one of the floor on either side; the wall's lower edge has the place as well
  EXPECT_EQ(copies[0.2F], 2);   // one of the floor, one of the wall
}

TEST(CutLines, TilesThatOverlapInOnePlaneMakeNoLines) {
  Threads threads(1);
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, 1, 1);
  testing::add_grid(scene, {-0.25F, 1e-6F, 0.25F}, {0.5F, 1e-5F, 0}, {0, 0, -0.5F}, 1, 1);
  EXPECT_TRUE(find_contact_lines(scene.mesh, std::vector<bool>(4, true), threads).empty());
}

TEST(CutLines, SameBitsForAnyNumberOfThreads) {
  Threads one(1), two(2);
  const Scene scene = box_in_floor(11, true);
  const Subdivided a = refine(scene, 2000, true, one), b = refine(scene, 2000, true, two);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.values, b.values);
}

}  // namespace
}  // namespace kiln
