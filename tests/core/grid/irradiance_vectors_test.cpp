// What six irradiance vectors know of light, against closed forms.

#include "core/grid/irradiance_vectors.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <vector>

#include "core/base/random.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRays = 1 << 16;

IrradianceVectors gathered(const std::function<Vec3f(const Vec3f&)>& light) {
  OctantSums sums;
  for (std::uint32_t k = 0; k < kRays; ++k) {
    const Vec2f u = sobol_owen(k, 1);
    const Vec3f w = to_float(uniform_sphere({u.x, u.y}));
    sums.add(w, light(w));
  }
  return sums.vectors(static_cast<float>(4 * kPi / kRays));
}

std::vector<Vec3f> some_normals() {
  std::vector<Vec3f> out{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, normalized(Vec3f{1, 1, 1}), normalized(Vec3f{-1, 1, 0})};
  for (std::uint64_t i = 0; i < 40; ++i) {
    Random random(7, i);
    const double x = random.uniform_double(), y = random.uniform_double();
    out.push_back(to_float(uniform_sphere(Vec2<double>{x, y})));
  }
  return out;
}

// Sums of 65536 stratified rays: 1e-4 of the value, and their float sums about the same.
constexpr float kNear = 3e-4F;

TEST(IrradianceVectors, OfConstantLightPointAlongTheirDirectionsWithLengthPi) {
  const IrradianceVectors v = gathered([](const Vec3f&) { return Vec3f{1, 2, 4}; });
  for (std::size_t d = 0; d < kDirections; ++d) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float radiance = static_cast<float>(1 << c), sign = d % 2 == 0 ? 1.0F : -1.0F;
      Vec3f truth;
      truth[d / 2] = sign * radiance * static_cast<float>(kPi);
      EXPECT_LT(length(v.vector[d][c] - truth), radiance * static_cast<float>(kPi) * 2 * kNear);
    }
  }
}

TEST(IrradianceVectors, ExactBlendOfConstantLightIsPiInEveryDirection) {
  const auto parts = exact_parts(gathered([](const Vec3f&) { return Vec3f{1, 1, 1}; }));
  for (const Vec3f& n : some_normals()) EXPECT_NEAR(exact_irradiance(parts, n).x, kPi, kPi * kNear);
}

TEST(IrradianceVectors, PaperBlendOfConstantLightIsTheSumOfCubes) {
  const IrradianceVectors v = gathered([](const Vec3f&) { return Vec3f{1, 1, 1}; });
  for (const Vec3f& n : some_normals()) {
    const double cubes = std::pow(std::abs(n.x), 3) + std::pow(std::abs(n.y), 3) + std::pow(std::abs(n.z), 3);
    EXPECT_NEAR(paper_irradiance(v, n).x, kPi * cubes, kPi * 2 * kNear);
    // With white light the texels lose nothing: colour x direction is the vector.
    EXPECT_NEAR(texel_irradiance(paper_parts(v), n).x, kPi * cubes, kPi * 2 * kNear);
  }
  EXPECT_NEAR(paper_irradiance(v, normalized(Vec3f{1, 1, 1})).x / kPi, 0.577, 1e-3);
}

TEST(IrradianceVectors, ExactBlendReproducesLightOfThreeBands) {
  // E(n) = sum A_l L_lm Y_lm(n), A = pi, 2 pi / 3, pi / 4 (Ramamoorthi and Hanrahan 2001).
  constexpr double kBand[] = {kPi, 2 * kPi / 3, kPi / 4};
  for (int i = 0; i < 9; ++i) {
    const double with = i == 0 ? 0 : 1;  // beside constant light, so that no irradiance is negative
    const auto radiance = [&](const Vec3f& w) {
      std::array<double, 9> y;
      evaluate_sh(3, to_double(w), y.data());
      const auto x = static_cast<float>(y[static_cast<std::size_t>(i)] + with);
      return Vec3f{x, x, x};
    };
    const auto parts = exact_parts(gathered(radiance));
    for (const Vec3f& n : some_normals()) {
      std::array<double, 9> y;
      evaluate_sh(3, to_double(n), y.data());
      const double band = kBand[i == 0 ? 0 : i < 4 ? 1 : 2];
      EXPECT_NEAR(exact_irradiance(parts, n).x, band * y[static_cast<std::size_t>(i)] + with * kPi, kPi * 2 * kNear);
    }
  }
}

TEST(IrradianceVectors, OfASingleRayAreItsClampedCosineAlongTheAxes) {
  const Vec3f w = normalized(Vec3f{1, -2, 3});
  OctantSums sums;
  sums.add(w, {5, 5, 5});
  const IrradianceVectors v = sums.vectors(1);
  const auto exact = exact_parts(v);
  const auto paper = paper_parts(v);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0F, -1.0F}) {
      Vec3f n;
      n[axis] = sign;
      const float truth = 5 * std::max(0.0F, dot(w, n));
      EXPECT_NEAR(exact_irradiance(exact, n).y, truth, 1e-5F);
      EXPECT_NEAR(paper_irradiance(v, n).y, truth, 1e-5F);
      EXPECT_NEAR(texel_irradiance(paper, n).y, truth, 1e-5F);
    }
  }
}

TEST(IrradianceVectors, KeepColoursApart) {
  // Red from +x, blue from -x: each side sees its own.
  const auto parts = exact_parts(gathered([](const Vec3f& w) { return w.x > 0 ? Vec3f{1, 0, 0} : Vec3f{0, 0, 1}; }));
  EXPECT_NEAR(exact_irradiance(parts, {1, 0, 0}).x, kPi, kPi * kNear);
  EXPECT_NEAR(exact_irradiance(parts, {1, 0, 0}).z, 0, kPi * kNear);
  EXPECT_NEAR(exact_irradiance(parts, {-1, 0, 0}).z, kPi, kPi * kNear);
  EXPECT_EQ(exact_irradiance(parts, {-1, 0, 0}).y, 0);
}

}  // namespace
}  // namespace kiln
