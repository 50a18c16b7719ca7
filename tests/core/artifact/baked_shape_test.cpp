// Geometry that a mesh may have and Draco may change: what arrives is still right, and the file says so.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "core/artifact/streams.h"
#include "core/base/expects.h"
#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/round_trip.h"
#include "tests/core/artifact/sample_scene.h"

namespace kiln {
namespace {

/// A scene of one part with these triangles over `vertices` random places; flat slot 0 holds the vertex number.
BakedScene with_triangles(std::uint32_t vertices, std::vector<Triangle> triangles) {
  BakedScene out = random_baked({.order = 1, .channels = 1, .side = 12});
  Mesh& mesh = out.scene.mesh;
  mesh.position.resize(vertices);
  mesh.normal.resize(vertices);
  mesh.uv0.clear();
  mesh.uv1.clear();
  mesh.color.clear();
  mesh.tangent.clear();
  mesh.part.assign(triangles.size(), 0);
  mesh.triangles = std::move(triangles);
  out.scene.parts.resize(1);
  out.transfer.coefficients.resize(vertices);
  return out;
}

/// The triangles that came back, as sets of the vertices they had.
std::multiset<std::set<std::uint32_t>> triangles_of(const BakedScene& read) {
  const auto original = original_vertices(read);
  std::multiset<std::set<std::uint32_t>> out;
  for (const Triangle& t : read.scene.mesh.triangles) out.insert({original[t[0]], original[t[1]], original[t[2]]});
  return out;
}

TEST(BakedShape, ThreeFacesOnAnEdgeSurvive) {
  const BakedScene read = round_trip(with_triangles(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}));
  EXPECT_EQ(triangles_of(read), (std::multiset<std::set<std::uint32_t>>{{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}));
}

TEST(BakedShape, DuplicateAndFlippedFacesSurvive) {
  const BakedScene read = round_trip(with_triangles(3, {{0, 1, 2}, {0, 1, 2}, {2, 1, 0}}));
  EXPECT_EQ(triangles_of(read).count({0, 1, 2}), 3u);
}

TEST(BakedShape, TwoFansThatTouchInAVertexSurvive) {
  const BakedScene read = round_trip(with_triangles(5, {{0, 1, 2}, {0, 3, 4}}));
  EXPECT_EQ(triangles_of(read), (std::multiset<std::set<std::uint32_t>>{{0, 1, 2}, {0, 3, 4}}));
}

TEST(BakedShape, TrianglesWithEqualCornersAndUnusedVerticesAreLeftOut) {
  const BakedScene read = round_trip(with_triangles(9, {{0, 1, 2}, {3, 3, 4}, {5, 6, 5}, {2, 1, 7}}));
  EXPECT_EQ(triangles_of(read), (std::multiset<std::set<std::uint32_t>>{{0, 1, 2}, {1, 2, 7}}));
  const auto original = original_vertices(read);
  EXPECT_EQ(std::set<std::uint32_t>(original.begin(), original.end()), (std::set<std::uint32_t>{0, 1, 2, 7}));
}

TEST(BakedShape, AnUnusedVertexDoesNotWidenTheRangeOfASlot) {
  BakedScene written = with_triangles(4, {{0, 1, 2}});
  written.transfer.coefficients = {0, 1, 2, 1e9F};
  const BakedScene read = round_trip(written);
  std::vector<float> values = read.transfer.coefficients;
  std::ranges::sort(values);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(values[i], static_cast<float>(i), 1.001 / 4095);  // half a step of 2 / 4095, rounding
}

TEST(BakedShape, APartWithoutTrianglesIsLeftOut) {
  BakedScene written = random_baked({.order = 1, .channels = 1});
  Mesh& mesh = written.scene.mesh;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.part[t] == 1) mesh.triangles[t][1] = mesh.triangles[t][0];
  }
  const BakedScene read = round_trip(written);
  ASSERT_EQ(read.scene.parts.size(), 3u);
  EXPECT_EQ(read.scene.parts[1].name, "coloured");
}

TEST(BakedShape, ASceneWithoutTrianglesIsAFault) {
  BakedScene written = single_triangle(1, 1, false);
  written.scene.mesh.triangles = {{0, 0, 1}};
  const auto file = write_baked_glb(written);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, "nothing_to_write");
}

TEST(BakedShape, NonFiniteCoefficientsAreOurOwnMistake) {
  BakedScene written = single_triangle(1, 1, false);
  written.transfer.coefficients[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(write_baked_glb(written)), ContractViolation);
}

TEST(BakedShape, SequentialEncodingReadsBackToo) {
  // Draco takes the sequential method at speed 10, and encode_draco falls back to it.
  const BakedScene written = random_baked({.order = 1, .channels = 1});
  EXPECT_EQ(round_trip(written, {.speed = 10}).transfer.vertices(), written.transfer.vertices());
}

TEST(BakedShape, StreamsAddUpToTheFile) {
  const BakedScene written = sphere_over_plane(6, 3, true);
  const auto file = write_baked_glb(written);
  const auto rows = stream_bytes(written, {}, *file);
  ASSERT_TRUE(rows);
  std::uint64_t sum = 0;
  for (const StreamBytes& row : *rows) sum += row.bytes;
  EXPECT_EQ(sum, file->size());
  EXPECT_GT((*rows)[5].bytes, file->size() / 2) << "108 coefficients outweigh all else";
}

}  // namespace
}  // namespace kiln
