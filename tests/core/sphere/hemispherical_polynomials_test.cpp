#include "core/sphere/hemispherical_polynomials.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/base/random.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr std::size_t kMax = polynomial_count(kMaxPolynomialDegree);

std::array<double, kMax> random_coefficients(Random& random) {
  std::array<double, kMax> c;
  for (double& x : c) x = random.uniform_double() - 0.5;
  return c;
}

TEST(HemisphericalPolynomials, DegreeFourHasFifteenMonomialsInOrder) {
  std::array<double, 15> p;
  static_assert(polynomial_count(4) == 15);
  const double x = 0.3, y = -0.4;
  evaluate_polynomials(4, {x, y, 0.5}, p.data());
  std::size_t at = 0;
  for (int k = 0; k <= 4; ++k)
    for (int j = 0; j <= k; ++j) EXPECT_DOUBLE_EQ(p[at++], std::pow(x, k - j) * std::pow(y, j));
}

TEST(HemisphericalPolynomials, ReflectionTakesTheValueAtMinusXMinusYAndIsItsOwnInverse) {
  Random random(1, 0);
  for (int degree = 0; degree <= kMaxPolynomialDegree; ++degree) {
    const auto c = random_coefficients(random);
    auto turned = c;
    reflect_polynomials(degree, turned.data());
    const Vec3d w = cosine_hemisphere(Vec2d{random.uniform_double(), random.uniform_double()});
    std::array<double, kMax> here{}, there{};
    evaluate_polynomials(degree, w, here.data());
    evaluate_polynomials(degree, {-w.x, -w.y, w.z}, there.data());
    double a = 0, b = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(polynomial_count(degree)); ++i)
      a += turned[i] * here[i], b += c[i] * there[i];
    EXPECT_NEAR(a, b, 1e-15);  // equal sums of 45 terms, signs apart
    reflect_polynomials(degree, turned.data());
    EXPECT_EQ(turned, c);
  }
}

TEST(HemisphericalPolynomials, AreHarmonicsThatAreEvenInZ) {
  Random random(2, 0);
  for (int degree = 0; degree <= kMaxPolynomialDegree; ++degree) {
    const auto c = random_coefficients(random);
    std::array<double, sh_count(kMaxPolynomialDegree + 1)> sh{}, y{};
    polynomials_to_sh(degree, c.data(), sh.data());
    int used = 0;
    for (int l = 0; l <= degree; ++l) {
      for (int m = -l; m <= l; ++m) {
        if ((l + m) % 2 != 0) {
          EXPECT_NEAR(sh[static_cast<std::size_t>(l * (l + 1) + m)], 0, 1e-14);
        }
        used += (l + m) % 2 == 0;
      }
    }
    EXPECT_EQ(used, polynomial_count(degree));
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3d w = uniform_sphere({random.uniform_double(), random.uniform_double()});
      std::array<double, kMax> p{};
      evaluate_polynomials(degree, w, p.data());
      evaluate_sh(degree + 1, w, y.data());
      double a = 0, b = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(polynomial_count(degree)); ++i) a += c[i] * p[i];
      for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(degree + 1)); ++i) b += sh[i] * y[i];
      EXPECT_NEAR(a, b, 1e-13);  // 81 terms of size 1
    }
  }
}

}  // namespace
}  // namespace kiln
