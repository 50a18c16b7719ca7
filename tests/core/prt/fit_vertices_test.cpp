#include "core/prt/fit_vertices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/prt/subdivide.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

using Field = std::function<float(const Vec3f&)>;

Mesh floor_of(int cells) {
  Scene scene = testing::empty_scene();
  testing::add_grid(scene, {-0.5F, 0, 0.5F}, {1, 0, 0}, {0, 0, -1}, cells, cells);
  return scene.mesh;
}

ValueSource source_of(const Field& field) {
  return {1,
          [field](std::span<const TransferPoint> points) {
            std::vector<float> values;
            for (const TransferPoint& p : points) values.push_back(field(p.position));
            return values;
          },
          {0}};
}

Subdivided refine(const Mesh& mesh, const Field& field, std::uint64_t triangles) {
  Threads threads(2);
  return subdivide(mesh, source_of(field), {.triangles = triangles}, threads);
}

/// RMS over the surface of (interpolated - field), by 16 points of each triangle.
double error_of(const Mesh& mesh, const std::vector<float>& values, const Field& field) {
  double sum = 0, area_sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const double area =
        length(cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]));
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        float u = (static_cast<float>(i) + 0.5F) / 4, v = (static_cast<float>(j) + 0.5F) / 4;
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const float w = 1 - u - v;
        const Vec3f p = mesh.position[t[0]] * w + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
        const double d = w * values[t[0]] + u * values[t[1]] + v * values[t[2]] - field(p);
        sum += area * d * d / 16;
      }
    }
    area_sum += area;
  }
  return std::sqrt(sum / area_sum);
}

std::vector<float> sampled(const Mesh& mesh, const Field& field) {
  std::vector<float> values;
  for (const Vec3f& p : mesh.position) values.push_back(field(p));
  return values;
}

TEST(FitVertices, ALinearFieldStaysAsItIs) {
  const Field linear = [](const Vec3f& p) { return 0.25F + 0.5F * p.x - 0.125F * p.z; };
  const Field kink = [&](const Vec3f& p) { return linear(p) + std::max(0.0F, p.x - 0.375F); };  // makes it split there
  const Subdivided fine = refine(floor_of(4), kink, 200);
  ASSERT_GT(fine.mesh.triangles.size(), 100U);
  for (std::size_t v = 0; v < fine.mesh.position.size(); ++v) {
    // The kink's pull dies out by a factor of 5 from vertex to vertex; these are eight coarse cells away.
    if (fine.mesh.position[v].x > -0.25F) continue;
    EXPECT_NEAR(fine.values[v], linear(fine.mesh.position[v]), 2e-4);
  }
}

TEST(FitVertices, HalvesTheErrorOfASmoothField) {
  const Field bowl = [](const Vec3f& p) { return 0.1F + p.x * p.x + p.z * p.z; };
  const Subdivided fine = refine(floor_of(4), bowl, 600);
  // Interpolating x^2 at the nodes leaves sqrt(1 / 120) h^2, the best linear spline sqrt(1 / 720) h^2: .41 of it. The
  // border and the bound at the bowl's bottom cost the rest.
  EXPECT_LT(error_of(fine.mesh, fine.values, bowl), 0.55 * error_of(fine.mesh, sampled(fine.mesh, bowl), bowl));
}

TEST(FitVertices, AShadowEdgeNeitherFallsBelowDarkNorRisesAboveLight) {
  const Field edge = [](const Vec3f& p) { return p.x + 0.3F * p.z > 0.06F ? 1.0F : 0.0F; };
  const Subdivided fine = refine(floor_of(8), edge, 1000);
  for (const float value : fine.values) {
    EXPECT_GE(value, -0x1p-13F);  // the rounding of stored rows
    EXPECT_LE(value, 1 + 0x1p-13F);
  }
  EXPECT_LT(error_of(fine.mesh, fine.values, edge), error_of(fine.mesh, sampled(fine.mesh, edge), edge));
}

TEST(FitVertices, TheSidesOfASeamStayEqual) {
  Mesh left = floor_of(4);
  Mesh both = left;  // the same floor twice, the second as a mirror image on its right: they meet along x = 0.5
  const auto first = static_cast<std::uint32_t>(left.position.size());
  for (std::size_t v = 0; v < left.position.size(); ++v) {
    both.position.push_back({1 - left.position[v].x, left.position[v].y, left.position[v].z});
    both.normal.push_back(left.normal[v]);
  }
  for (const Triangle& t : left.triangles) {
    both.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
    both.part.push_back(0);
  }
  const Field wave = [](const Vec3f& p) { return 0.5F + 0.4F * std::sin(9 * p.x + 4 * p.z); };
  const Subdivided fine = refine(both, wave, 700);
  int seam = 0;
  for (std::size_t a = 0; a < fine.mesh.position.size(); ++a) {
    for (std::size_t b = a + 1; b < fine.mesh.position.size(); ++b) {
      if (!(fine.mesh.position[a] == fine.mesh.position[b])) continue;
      EXPECT_EQ(fine.values[a], fine.values[b]);
      ++seam;
    }
  }
  EXPECT_GE(seam, 5);
}

}  // namespace
}  // namespace kiln
