// The fit of a grid to a surface against its closed form, and what it must leave alone.

#include "core/grid/surface_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

Grid even_grid(const std::array<int, 3>& size) {
  Grid grid{.lattice = lattice_over({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, size)};
  grid.parts.assign(kExactParts, std::vector<Vec3f>(grid.lattice.vertices()));
  for (std::size_t axis = 0; axis < 3; ++axis) grid.parts[3 + axis].assign(grid.lattice.vertices(), {2, 4, 6});
  return grid;  // E = 1, 2, 3 along all normals
}

std::vector<SurfacePlace> some_places(std::uint64_t count) {
  std::vector<SurfacePlace> out;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(3, i);
    const auto draw = [&] { return random.uniform() - 0.5F; };
    SurfacePlace p;
    p.position = {draw(), draw(), draw()};
    const double x = random.uniform_double(), y = random.uniform_double();
    p.normal = to_float(uniform_sphere(Vec2<double>{x, y}));
    p.light = Vec3f{1, 2, 3} + Vec3f{draw(), draw(), draw()} * 0.5F;
    out.push_back(p);
  }
  return out;
}

/// What equation 1 reads at each place: with the kernel K_st = sum over v of w_sv w_tv k(n_s . n_t),
/// k(c) = 1 + 3 b1^2 c + 5 b2^2 (3 c^2 - 1) / 2 (addition theorem), the change is K (K + trust)^-1 r.
std::vector<double> closed_form(const Grid& grid, const std::vector<SurfacePlace>& places, std::size_t channel) {
  const std::size_t n = places.size();
  std::vector<std::vector<double>> kernel(n, std::vector<double>(n));
  std::vector<LinearRead> reads;
  for (const SurfacePlace& p : places)
    reads.push_back(linear_read(grid.lattice, corners_read(grid, to_double(p.position), p.normal, GridPlace::surface)));
  for (std::size_t s = 0; s < n; ++s) {
    for (std::size_t t = 0; t < n; ++t) {
      const double c = dot(places[s].normal, places[t].normal);
      const double k = 1 + 3 * kBand1 * kBand1 * c + kBand2 * kBand2 * 5 * (3 * c * c - 1) / 2;
      for (std::size_t i = 0; i < 8; ++i) {
        for (std::size_t j = 0; j < 8; ++j) {
          if (reads[s].vertex[i] == reads[t].vertex[j])
            kernel[s][t] += k * double{reads[s].weight[i]} * double{reads[t].weight[j]};
        }
      }
    }
  }
  // Gauss and Jordan; K + trust is positive definite.
  std::vector<std::vector<double>> m = kernel;
  std::vector<double> r;
  for (std::size_t s = 0; s < n; ++s) {
    m[s][s] += double{kTrust};
    const Vec3f now = irradiance_at(grid, to_double(places[s].position), places[s].normal);
    r.push_back(double{places[s].light[channel]} - double{now[channel]});
  }
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k) continue;
      const double f = m[i][k] / m[k][k];
      for (std::size_t j = k; j < n; ++j) m[i][j] -= f * m[k][j];
      r[i] -= f * r[k];
    }
  }
  std::vector<double> out(n);
  for (std::size_t s = 0; s < n; ++s) {
    for (std::size_t t = 0; t < n; ++t) out[s] += kernel[s][t] * r[t] / m[t][t];
  }
  return out;
}

TEST(SurfaceFit, ReadsAtItsPlacesWhatTheClosedFormSays) {
  const std::vector<SurfacePlace> places = some_places(16);
  const Grid before = even_grid({3, 2, 2});
  Grid after = before;
  Threads threads(2);
  fit_to_surface(places, after, threads);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<double> change = closed_form(before, places, c);
    for (std::size_t s = 0; s < places.size(); ++s) {
      const Vec3d p = to_double(places[s].position);
      const double was = irradiance_at(before, p, places[s].normal)[c],
                   is = irradiance_at(after, p, places[s].normal)[c];
      EXPECT_NEAR(is - was, change[s],
                  2e-5);  // floats of size 3; more steps than places: conjugate gradients have ended
    }
  }
}

TEST(SurfaceFit, WhatReadsRightStaysBitForBit) {
  std::vector<SurfacePlace> places = some_places(40);
  const Grid before = even_grid({3, 3, 3});
  for (SurfacePlace& p : places) p.light = irradiance_at(before, to_double(p.position), p.normal);
  Grid after = before;
  Threads threads(2);
  fit_to_surface(places, after, threads);
  EXPECT_EQ(after.parts, before.parts);
}

TEST(SurfaceFit, VerticesThatNoPlaceReadsStay) {
  const Grid before = even_grid({4, 1, 1});
  Grid after = before;
  SurfacePlace p = some_places(1)[0];
  p.position = {-0.3F, 0, 0};  // between vertices 0 (-.375) and 1 (-.125)
  Threads threads(1);
  fit_to_surface({p}, after, threads);
  for (std::size_t k = 0; k < kExactParts; ++k) {
    EXPECT_EQ(after.parts[k][2], before.parts[k][2]);
    EXPECT_EQ(after.parts[k][3], before.parts[k][3]);
  }
  EXPECT_NE(after.parts[3][0], before.parts[3][0]);
}

TEST(SurfaceFit, WithoutPlacesChangesNothing) {
  const Grid before = even_grid({2, 2, 2});
  Grid after = before;
  Threads threads(1);
  fit_to_surface({}, after, threads);
  EXPECT_EQ(after.parts, before.parts);
}

}  // namespace
}  // namespace kiln
