#include "core/sphere/sh.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr auto kMax = static_cast<std::size_t>(sh_count(kMaxShOrder));
constexpr double kPi = std::numbers::pi;
using Coefficients = std::array<float, kMax>;

std::vector<Vec3d> random_directions(int count, std::uint64_t seed) {
  Random random(seed, 0);
  std::vector<Vec3d> directions{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}};
  while (static_cast<int>(directions.size()) < count)
    directions.push_back(uniform_sphere({random.uniform_double(), random.uniform_double()}));
  return directions;
}

Basis<float> random_basis(Random& random) {
  const Vec3d z = uniform_sphere({random.uniform_double(), random.uniform_double()});
  const Basis<double> around = basis_around(z);
  const double turn = 2 * kPi * random.uniform_double();
  const Vec3d x = around.x * std::cos(turn) + around.y * std::sin(turn);
  return {to_float(x), to_float(cross(z, x)), to_float(z)};
}

double expand(int order, const float* coefficients, const Vec3d& w) {
  std::array<double, kMax> y{};
  evaluate_sh(order, w, y.data());
  double sum = 0;
  for (int i = 0; i < sh_count(order); ++i) sum += y[static_cast<std::size_t>(i)] * coefficients[i];
  return sum;
}

TEST(Sh, FirstBandsAreTheirClosedForms) {
  for (const Vec3d& w : random_directions(50, 1)) {
    std::array<double, 9> y{};
    evaluate_sh(3, w, y.data());
    EXPECT_NEAR(y[0], std::sqrt(1 / (4 * kPi)), 1e-15);
    EXPECT_NEAR(y[1], std::sqrt(3 / (4 * kPi)) * w.y, 1e-15);
    EXPECT_NEAR(y[2], std::sqrt(3 / (4 * kPi)) * w.z, 1e-15);
    EXPECT_NEAR(y[3], std::sqrt(3 / (4 * kPi)) * w.x, 1e-15);
    EXPECT_NEAR(y[4], std::sqrt(15 / (4 * kPi)) * w.x * w.y, 1e-14);
    EXPECT_NEAR(y[5], std::sqrt(15 / (4 * kPi)) * w.y * w.z, 1e-14);
    EXPECT_NEAR(y[6], std::sqrt(5 / (16 * kPi)) * (3 * w.z * w.z - 1), 1e-14);
    EXPECT_NEAR(y[7], std::sqrt(15 / (4 * kPi)) * w.x * w.z, 1e-14);
    EXPECT_NEAR(y[8], std::sqrt(15 / (16 * kPi)) * (w.x * w.x - w.y * w.y), 1e-14);
  }
}

TEST(Sh, FunctionsAreOrthonormal) {
  std::vector<double> gram(kMax * kMax);
  std::array<double, kMax> y{};
  for (const SphereNode& node : sphere_quadrature(2 * (kMaxShOrder - 1))) {
    evaluate_sh(kMaxShOrder, node.direction, y.data());
    for (std::size_t i = 0; i < kMax; ++i)
      for (std::size_t k = 0; k < kMax; ++k) gram[i * kMax + k] += node.weight * y[i] * y[k];
  }
  for (std::size_t i = 0; i < kMax; ++i)
    for (std::size_t k = 0; k < kMax; ++k) EXPECT_NEAR(gram[i * kMax + k], i == k, 1e-13) << i << ' ' << k;
}

TEST(Sh, AdditionTheoremHoldsAndFloatAgreesWithDouble) {
  for (const Vec3d& w : random_directions(200, 2)) {
    std::array<double, kMax> y{};
    Coefficients single{};
    evaluate_sh(kMaxShOrder, w, y.data());
    evaluate_sh(kMaxShOrder, to_float(w), single.data());
    for (int l = 0; l < kMaxShOrder; ++l) {
      double sum = 0;
      for (auto i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>((l + 1) * (l + 1)); ++i)
        sum += y[i] * y[i];
      EXPECT_NEAR(sum, (2 * l + 1) / (4 * kPi), 1e-13);
    }
    // Rounding w to float moves Y by up to l |Y| 2^-24; the recurrence adds as much again.
    for (std::size_t i = 0; i < kMax; ++i) EXPECT_NEAR(single[i], y[i], 5e-6);
  }
}

TEST(Sh, EveryOrderIsAPrefixOfTheHighest) {
  const Vec3f w = normalized(Vec3f{0.3F, -0.5F, 0.8F});
  Coefficients all{};
  evaluate_sh(kMaxShOrder, w, all.data());
  for (int order = 1; order <= kMaxShOrder; ++order) {
    Coefficients some{};
    evaluate_sh(order, w, some.data());
    for (std::size_t i = 0; i < kMax; ++i)
      EXPECT_EQ(some[i], i < static_cast<std::size_t>(sh_count(order)) ? all[i] : 0);
  }
}

TEST(Sh, ExpansionReproducesAPolynomialOfItsDegree) {
  for (int order = 1; order <= kMaxShOrder; ++order) {
    const int degree = order - 1;
    const Vec3d axis = normalized(Vec3d{0.2, 0.7, -0.4});
    const auto polynomial = [&](const Vec3d& w) { return std::pow(dot(w, axis) + 0.25 * w.x - 0.1, degree); };
    std::array<double, kMax> projected{}, y{};
    for (const SphereNode& node : sphere_quadrature(2 * degree)) {
      evaluate_sh(order, node.direction, y.data());
      for (std::size_t i = 0; i < kMax; ++i) projected[i] += node.weight * polynomial(node.direction) * y[i];
    }
    for (const Vec3d& w : random_directions(20, 3)) {
      double sum = 0;
      evaluate_sh(order, w, y.data());
      for (std::size_t i = 0; i < kMax; ++i) sum += projected[i] * y[i];
      EXPECT_NEAR(sum, polynomial(w), 1e-12) << "order " << order;
    }
  }
}

TEST(ShRotation, RotatedFunctionTakesTheValuesOfTheLocalOne) {
  Random random(4, 0);
  for (int order = 1; order <= kMaxShOrder; ++order) {
    for (int trial = 0; trial < 20; ++trial) {
      const Basis<float> basis = random_basis(random);
      Coefficients local{}, world{};
      for (float& c : local) c = random.uniform() - 0.5F;
      rotate_sh(order, basis, local.data(), world.data());
      for (const Vec3d& w : random_directions(10, 5)) {
        const Vec3d turned{dot(w, to_double(basis.x)), dot(w, to_double(basis.y)), dot(w, to_double(basis.z))};
        // 100 terms of size 1, each rounded a dozen times in float.
        EXPECT_NEAR(expand(order, world.data(), w), expand(order, local.data(), turned), 1e-5) << "order " << order;
      }
    }
  }
}

TEST(ShRotation, ThereAndBackAgainIsTheIdentityAlsoInPlace) {
  Random random(5, 0);
  for (int order = 1; order <= kMaxShOrder; ++order) {
    const Basis<float> b = random_basis(random);
    const Basis<float> inverse{{b.x.x, b.y.x, b.z.x}, {b.x.y, b.y.y, b.z.y}, {b.x.z, b.y.z, b.z.z}};
    Coefficients before{}, after{};
    for (float& c : before) c = random.uniform() - 0.5F;
    after = before;
    rotate_sh(order, b, after.data(), after.data());
    rotate_sh(order, inverse, after.data(), after.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(order)); ++i) EXPECT_NEAR(after[i], before[i], 5e-6);
  }
}

TEST(ShRotation, FramesAtAndNearThePolesAreExact) {
  for (const double tilt : {0.0, 1e-30, 1e-12, 1e-7, 1e-4, 1e-3}) {
    for (const double pole : {1.0, -1.0}) {
      const Vec3d z = normalized(Vec3d{tilt * 0.6, -tilt * 0.8, pole});
      const Basis<double> around = basis_around(z);
      const Vec3d x = around.x * std::cos(0.7) + around.y * std::sin(0.7), y = cross(z, x);
      Coefficients local{}, world{};
      Random random(6, 0);
      for (float& c : local) c = random.uniform() - 0.5F;
      rotate_sh(kMaxShOrder, {to_float(x), to_float(y), to_float(z)}, local.data(), world.data());
      for (const Vec3d& w : random_directions(20, 7))
        EXPECT_NEAR(expand(kMaxShOrder, world.data(), w),
                    expand(kMaxShOrder, local.data(), {dot(w, x), dot(w, y), dot(w, z)}), 2e-5)
            << "tilt " << tilt << ", pole " << pole;
    }
  }
}

TEST(ClampedCosine, IsTheProjectionOfTheClampedCosine) {
  // In the frame of n the integrand is a polynomial on each half of [-1, 1]: 10 nodes on the upper half are exact.
  const Vec3f n = normalized(Vec3f{-0.3F, 0.4F, 0.6F});
  const Basis<double> frame = basis_around(normalized(to_double(n)));
  std::array<double, kMax> projected{}, y{};
  for (const QuadratureNode& node : gauss_legendre(12)) {
    const double z = 0.5 * (node.x + 1), radius = std::sqrt(1 - z * z);
    for (int k = 0; k < 20; ++k) {
      const double phi = 2 * kPi * k / 20;
      evaluate_sh(kMaxShOrder, frame.to_world({radius * std::cos(phi), radius * std::sin(phi), z}), y.data());
      for (std::size_t i = 0; i < kMax; ++i) projected[i] += 0.5 * node.weight * 2 * kPi / 20 * z / kPi * y[i];
    }
  }
  Coefficients transfer{};
  clamped_cosine_transfer(kMaxShOrder, n, transfer.data());
  for (std::size_t i = 0; i < kMax; ++i) EXPECT_NEAR(transfer[i], projected[i], 1e-6) << i;
}

TEST(ClampedCosine, UnderAConstantSkyOfOneGivesOne) {
  for (const Vec3d& n : random_directions(50, 8)) {
    for (int order = 1; order <= kMaxShOrder; ++order) {
      Coefficients transfer{};
      clamped_cosine_transfer(order, to_float(n), transfer.data());
      EXPECT_NEAR(transfer[0] * std::sqrt(4 * kPi), 1, 1e-7);
    }
  }
}

TEST(ClampedCosine, BandsAreThoseOfRamamoorthiAndHanrahan) {
  Coefficients transfer{}, y{};
  clamped_cosine_transfer(5, {0, 0, 1}, transfer.data());
  evaluate_sh(5, Vec3f{0, 0, 1}, y.data());
  EXPECT_NEAR(transfer[2] / y[2], 2.0 / 3, 1e-6);
  EXPECT_NEAR(transfer[6] / y[6], 1.0 / 4, 1e-6);
  EXPECT_EQ(transfer[12], 0);
  EXPECT_NEAR(transfer[20] / y[20], -1.0 / 24, 1e-6);
}

TEST(ShWindow, KeepsTheMeanAndLowersTheRingingOfASmallSun) {
  Coefficients sun{};
  evaluate_sh(6, Vec3f{0, 0, 1}, sun.data());
  const auto lowest = [](const Coefficients& c) {
    double least = 0;
    for (const Vec3d& w : random_directions(500, 9)) least = std::min(least, expand(6, c.data(), w));
    return least;
  };
  Coefficients windowed = sun;
  window_sh(6, 0.01F, windowed.data());
  EXPECT_EQ(windowed[0], sun[0]);
  EXPECT_LT(-lowest(windowed), -0.5 * lowest(sun));
  Coefficients same = sun;
  window_sh(6, 0, same.data());
  EXPECT_EQ(same, sun);
}

}  // namespace
}  // namespace kiln
