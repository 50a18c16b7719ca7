#include "core/prt/components.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

/// A strip of triangles of different sizes, so that vertices count differently.
Mesh strip(std::size_t vertices) {
  Mesh mesh;
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto x = static_cast<float>(v);
    mesh.position.push_back({0.01F * x * x, v % 2 == 0 ? 0.0F : 1.0F, 0});
  }
  for (std::uint32_t v = 0; v + 2 < vertices; ++v) mesh.triangles.push_back({v, v + 1, v + 2});
  return mesh;
}

/// Mean light of about 1/2 and random vectors in a space of `rank` dimensions around it.
Transfer random_transfer(int order, int channels, std::size_t vertices, std::size_t rank, bool fixed = false) {
  Transfer out{order, channels, fixed, {}};
  Random random(7, 3);
  std::vector<float> directions(rank * out.stride());
  for (float& d : directions) d = random.uniform() - 0.5F;
  for (std::size_t v = 0; v < vertices; ++v) {
    std::vector<float> t(out.stride(), 0.0F);
    for (int c = 0; c < channels; ++c) t[static_cast<std::size_t>(c * out.slots())] = 0.15F;
    for (std::size_t k = 0; k < rank; ++k) {
      const float w = (random.uniform() - 0.5F) * std::exp2(-static_cast<float>(k));
      for (std::size_t s = 0; s < t.size(); ++s) t[s] += w * directions[k * t.size() + s];
    }
    out.coefficients.insert(out.coefficients.end(), t.begin(), t.end());
  }
  return out;
}

const std::vector<double> kSun(5, 4 * std::numbers::pi);

std::vector<double> sun(int order) { return {kSun.begin(), kSun.begin() + order}; }

TEST(Components, AsManyAsTheSpaceHasDimensionsLeaveNothingOut) {
  const Transfer transfer = random_transfer(4, 3, 300, 5);
  const ComponentAnalysis analysis = analyse_components(transfer, strip(300), sun(4));
  EXPECT_GT(analysis.left_out[4], 1e-3);
  EXPECT_LT(analysis.left_out[5], 1e-6);  // floats of size 1 in, so 1e-7 each
  for (std::size_t r = 0; r + 1 < analysis.left_out.size(); ++r)
    EXPECT_GE(analysis.left_out[r], analysis.left_out[r + 1]);
}

TEST(Components, MeanAndWeightedRowsGiveTheVectorsBack) {
  for (const int channels : {1, 3}) {
    const Transfer transfer = random_transfer(3, channels, 100, 4, true);
    const ComponentAnalysis analysis = analyse_components(transfer, strip(100), sun(3));
    const Components few = analysis.first(4);
    const auto weights = analysis.weights(transfer, 4);
    for (std::size_t v = 0; v < 100; ++v) {
      for (std::size_t s = 0; s < transfer.stride(); ++s) {
        if (static_cast<int>(s) % transfer.slots() == transfer.slots() - 1) {
          EXPECT_EQ(few.mean()[s], 0);  // the lamps are no part of it
          continue;
        }
        double value = few.mean()[s];
        for (std::size_t k = 0; k < 4; ++k) value += double{weights[v * 4 + k]} * few.row(k)[s];
        ASSERT_NEAR(value, transfer.at(v, 0)[s], 2e-6);
      }
    }
  }
}

TEST(Components, WhatIsLeftOutIsTheErrorOfLightFromAllDirections) {
  // A sun of mean 1 in direction w has coefficients 4 pi Y(w). Averaged over all w by an exact quadrature, the squared
  // error that it shows, relative to the mean light, must be what the analysis says; the vertices count by area.
  const std::size_t vertices = 60;
  const Transfer transfer = random_transfer(3, 3, vertices, 9);
  const Mesh mesh = strip(vertices);
  const ComponentAnalysis analysis = analyse_components(transfer, mesh, sun(3));
  const Components few = analysis.first(3);
  const auto weights = analysis.weights(transfer, 3);

  std::vector<double> area(vertices, 0.0);
  for (const Triangle& t : mesh.triangles) {
    const Vec3f a = mesh.position[t[0]], b = mesh.position[t[1]], c = mesh.position[t[2]];
    for (const auto v : t) area[v] += length(cross(b - a, c - a));
  }
  double total = 0, mean = 0, squared = 0;
  for (const double a : area) total += a;
  for (std::size_t v = 0; v < vertices; ++v) {
    std::vector<double> difference(transfer.stride());
    for (std::size_t s = 0; s < difference.size(); ++s) {
      difference[s] = few.mean()[s] - transfer.at(v, 0)[s];
      for (std::size_t k = 0; k < 3; ++k) difference[s] += double{weights[v * 3 + k]} * few.row(k)[s];
    }
    for (std::size_t c = 0; c < 3; ++c) {
      mean += area[v] / total * transfer.at(v, static_cast<int>(c))[0] * 2 * std::sqrt(std::numbers::pi) / 3;
      for (const auto& [direction, weight] : sphere_quadrature(5)) {
        std::array<double, 9> y{};
        evaluate_sh(3, direction, y.data());
        double error = 0;
        for (std::size_t i = 0; i < 9; ++i) error += difference[9 * c + i] * 4 * std::numbers::pi * y[i];
        squared += area[v] / total * error * error * weight / (4 * std::numbers::pi) / 3;
      }
    }
  }
  EXPECT_NEAR(std::sqrt(squared) / mean, analysis.left_out[3], 1e-5);
}

TEST(Components, SameNumbersEachTime) {
  const Transfer transfer = random_transfer(5, 3, 5000, 20);  // more than one block
  const Mesh mesh = strip(5000);
  const auto a = analyse_components(transfer, mesh, sun(5)), b = analyse_components(transfer, mesh, sun(5));
  EXPECT_EQ(a.components.rows, b.components.rows);
  EXPECT_EQ(a.weights(transfer, 7), b.weights(transfer, 7));
}

TEST(Components, ASurfaceThatNoLightReachesHasNoComponentThatCounts) {
  Transfer transfer{3, 1, false, std::vector<float>(9 * 50, 0.0F)};
  for (std::size_t i = 0; i < transfer.coefficients.size(); ++i) transfer.coefficients[i] = i % 7 == 0 ? 1e-9F : 0;
  EXPECT_LT(analyse_components(transfer, strip(50), sun(3)).left_out[0], 1e-5);
}

}  // namespace
}  // namespace kiln
