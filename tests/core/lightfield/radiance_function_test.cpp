#include "core/lightfield/radiance_function.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/lightfield/hemisphere_norm.h"
#include "tests/core/lightfield/random_radiance.h"

namespace kiln {
namespace {

using testing::random_above;
using testing::random_direction;
using testing::random_radiance;

constexpr double kRounding = 1e-12;  // sums of at most 81 products of size 1, a few times over

void expect_near(const Vec3d& a, const Vec3d& b, double tolerance) { EXPECT_LT(length(a - b), tolerance); }

class EitherBasis : public ::testing::TestWithParam<RadianceBasis> {
 protected:
  Random random_{7, static_cast<std::uint64_t>(GetParam())};
  RadianceFunction any(int degree) { return random_radiance(random_, GetParam(), degree, random_direction(random_)); }

  /// A triangle whose corners have normals about one direction.
  RadianceTriangle triangle(int degree) {
    const Vec3d up = random_direction(random_);
    RadianceTriangle t;
    for (std::size_t c = 0; c < 3; ++c) {
      t.position[c] = random_direction(random_);
      t.reflected[c] = random_radiance(random_, GetParam(), degree, normalized(up + random_direction(random_) * 0.2));
    }
    return t;
  }
};
INSTANTIATE_TEST_SUITE_P(RadianceFunction, EitherBasis,
                         ::testing::Values(RadianceBasis::harmonics, RadianceBasis::polynomials));

TEST_P(EitherBasis, ReflectionTakesTheValueOfTheMirroredDirectionAndIsItsOwnInverse) {
  for (int degree = 0; degree <= 8; ++degree) {
    const RadianceFunction f = any(degree), r = reflected(f), back = reflected(r);
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3d w = random_direction(random_);  // below the horizon too
      expect_near(evaluate(r, w), evaluate(f, reflect_direction(f.normal, w)), kRounding);
    }
    for (std::size_t i = 0; i < f.coefficients.size(); ++i)
      EXPECT_NEAR(back.coefficients[i], f.coefficients[i], kRounding);
  }
}

TEST_P(EitherBasis, BelowTheHorizonTheHorizonGoesOn) {
  const RadianceFunction f = any(5);
  const Basis<double> frame = basis_around(f.normal);
  for (const double phi : {0.3, 2.0, 5.5}) {
    const Vec3d horizon = frame.to_world({std::cos(phi), std::sin(phi), 0});
    for (const double depth : {0.0, 1e-9, 0.5, 3.0}) {
      const Vec3d below = normalized(horizon - f.normal * depth);
      expect_near(evaluate(f, below), evaluate(f, horizon), 1e-9);
    }
    expect_near(evaluate(f, normalized(horizon + f.normal * 1e-7)), evaluate(f, horizon), 1e-5);  // no jump
  }
  EXPECT_TRUE(is_finite(evaluate(f, -f.normal)));
}

TEST_P(EitherBasis, OnItsHemisphereItIsHarmonics) {
  for (int degree = 0; degree <= 8; ++degree) {
    const RadianceFunction f = any(degree), h = to_harmonics(f);
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3d w = random_above(random_, f.normal);
      expect_near(evaluate(h, w), evaluate(f, w), kRounding);
    }
  }
}

TEST_P(EitherBasis, DistanceByHarmonicsIsThatOfItsOwnValues) {
  const RadianceFunction f = any(4);
  // Midpoint rule over 400 x 800 cells of (z, phi): error of order 1e-5 for a polynomial of degree 8.
  double sum = 0;
  const Basis<double> frame = basis_around(f.normal);
  for (int i = 0; i < 400; ++i) {
    const double z = (i + 0.5) / 400, radius = std::sqrt(1 - z * z);
    for (int k = 0; k < 80; ++k) {
      const double phi = 0.07853981633974483 * k;
      const Vec3d value = evaluate(f, frame.to_world({radius * std::cos(phi), radius * std::sin(phi), z}));
      sum += dot(value, value) / (400 * 80);
    }
  }
  EXPECT_NEAR(squared_norm(HemisphereNorm(4), f.normal, to_harmonics(f).coefficients), sum, 1e-4 * sum);
}

TEST_P(EitherBasis, InterpolationAtACornerIsTheCornersOwnFunction) {
  const RadianceTriangle t = triangle(4);
  for (std::size_t c = 0; c < 3; ++c) {
    Vec3d corner;
    corner[c] = 1;
    const Vec3d w = random_above(random_, t.reflected[c].normal);
    expect_near(interpolate(t, corner, t.reflected[c].normal, w), evaluate(reflected(t.reflected[c]), w), kRounding);
  }
}

TEST_P(EitherBasis, InterpolationIsEquationTwoInUnreflectedFunctions) {
  const RadianceTriangle t = triangle(4);
  const Vec3d a{0.2, 0.5, 0.3};
  const Vec3d n = normalized(t.reflected[0].normal * a.x + t.reflected[1].normal * a.y + t.reflected[2].normal * a.z);
  const Vec3d w = random_above(random_, n);
  Vec3d expected;
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3d turned = reflect_direction(t.reflected[c].normal, reflect_direction(n, w));  // R_ni R_n w
    expected += evaluate(reflected(t.reflected[c]), turned) * a[c];
  }
  expect_near(interpolate(t, a, n, w), expected, kRounding);
}

TEST_P(EitherBasis, ExtrapolationContinuesInterpolationAndIgnoresTheHeight) {
  for (int trial = 0; trial < 20; ++trial) {
    const RadianceTriangle t = triangle(4);
    const Vec3d normal = normalized(cross(t.position[1] - t.position[0], t.position[2] - t.position[0]));
    const Vec3d w = random_direction(random_);
    const double b = 3 * random_.uniform_double() - 1, c = 3 * random_.uniform_double() - 1;
    const Vec3d weights{1 - b - c, b, c};
    const Vec3d p = t.position[0] * weights.x + t.position[1] * b + t.position[2] * c;
    const Vec3d expected = interpolate_reflected(t, weights, w);  // (1) is affine, in and outside of the triangle
    const double tolerance = 1e-10 * (1 + length(expected));      // thin triangles divide by their height
    expect_near(extrapolate_reflected(t, p, w), expected, tolerance);
    expect_near(extrapolate_reflected(t, p + normal * 0.7, w), expected, 1e-8 * (1 + length(expected)));
    expect_near(foot_barycentrics(t.position, p + normal * 0.7), weights, 1e-8);
  }
}

TEST_P(EitherBasis, GradientLiesInThePlaneAndGivesTheDifferencesOfTheCorners) {
  const RadianceTriangle t = triangle(4);
  const Vec3d normal = normalized(cross(t.position[1] - t.position[0], t.position[2] - t.position[0]));
  const Vec3d w = random_direction(random_);
  const auto slope = gradient(t, w);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(dot(slope[channel], normal), 0, 1e-9 * (1 + length(slope[channel])));
    for (const std::size_t c : {1U, 2U}) {
      EXPECT_NEAR(dot(slope[channel], t.position[c] - t.position[0]),
                  evaluate(t.reflected[c], w)[channel] - evaluate(t.reflected[0], w)[channel], 1e-9);
    }
  }
}

TEST_P(EitherBasis, ATriangleWithoutAreaHasNoGradient) {
  RadianceTriangle t = triangle(2);
  t.position = {Vec3d{0, 0, 0}, Vec3d{1, 1, 1}, Vec3d{2, 2, 2}};
  expect_near(extrapolate_reflected(t, {5, 0, 0}, {0, 0, 1}), evaluate(t.reflected[0], {0, 0, 1}), kRounding);
  expect_near(foot_barycentrics(t.position, {5, 0, 0}), {1, 0, 0}, kRounding);
}

TEST(RadianceFunction, AHighlightOfDivergingNormalsStaysInPlaceWhenReflected) {
  // A distant source from +z and mirrors with normals to both sides of it: RFs peak apart, r-RFs all peak at the
  // source.
  const auto peak = [](const Vec3d& normal) {
    RadianceFunction f{.degree = 8, .normal = normal, .coefficients = std::vector<double>(3 * 81)};
    evaluate_sh(9, reflect_direction(normal, {0, 0, 1}), f.coefficients.data());
    return f;
  };
  const RadianceFunction left = peak(normalized(Vec3d{-0.4, 0, 1})), right = peak(normalized(Vec3d{0.4, 0, 1}));
  const RadianceFunction a = reflected(left), b = reflected(right);
  const HemisphereNorm norm(8);
  std::vector<double> apart(3 * 81), together(3 * 81);
  for (std::size_t i = 0; i < apart.size(); ++i) {
    apart[i] = left.coefficients[i] - right.coefficients[i];
    together[i] = a.coefficients[i] - b.coefficients[i];
  }
  EXPECT_LT(squared_norm(norm, {0, 0, 1}, together), 1e-20 * squared_norm(norm, {0, 0, 1}, apart));
}

}  // namespace
}  // namespace kiln
