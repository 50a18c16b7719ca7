// Light fields in hemispherical polynomials.
#include "core/lightfield/polynomial_space.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/lightfield/hemisphere_norm.h"
#include "tests/core/lightfield/random_radiance.h"

namespace kiln {
namespace {

using testing::random_direction;
using testing::random_radiance;

LightField field_of(const RadianceFunction& f) {
  LightField out{.degree = f.degree, .coefficients = {}};
  for (const double c : f.coefficients) out.coefficients.push_back(static_cast<float>(c));
  return out;
}

LightField kept(LightField field, const Vec3d& n) {
  Threads threads(1);
  const Vec3f normal[] = {to_float(n)};
  keep_polynomials(field, normal, threads);
  return field;
}

/// 1/(2 pi) integral over the hemisphere of f g, all channels.
double product(int degree, const Vec3d& n, const std::vector<double>& f, const std::vector<double>& g) {
  std::vector<double> sum(f), difference(f);
  for (std::size_t i = 0; i < f.size(); ++i) sum[i] += g[i], difference[i] -= g[i];
  const HemisphereNorm norm(degree);
  return (squared_norm(norm, n, sum) - squared_norm(norm, n, difference)) / 4;
}

constexpr double kFloat = 4e-6;  // coefficients of up to .5, 81 of them, rounded to floats

TEST(PolynomialSpace, KeepsWhatIsAPolynomial) {
  Random random(1, 0);
  for (int degree = 0; degree <= kMaxLightFieldDegree; ++degree) {
    const Vec3d n = random_direction(random);
    const RadianceFunction f = to_harmonics(random_radiance(random, RadianceBasis::polynomials, degree, n));
    const LightField before = field_of(f), after = kept(before, n);
    for (std::size_t i = 0; i < before.coefficients.size(); ++i)
      EXPECT_NEAR(after.coefficients[i], before.coefficients[i], kFloat) << degree;
  }
}

TEST(PolynomialSpace, LeavesNothingThatAPolynomialCouldHold) {
  // Least squares: what is left over stands at right angles on every polynomial of the degree.
  Random random(2, 0);
  for (const int degree : {1, 2, 4, 7}) {
    const Vec3d n = random_direction(random);
    const RadianceFunction f = random_radiance(random, RadianceBasis::harmonics, degree, n);
    const LightField after = kept(field_of(f), n);
    std::vector<double> left(f.coefficients);
    for (std::size_t i = 0; i < left.size(); ++i) left[i] -= double{after.coefficients[i]};
    EXPECT_GT(product(degree, n, left, left), 1e-4);  // odd ones do not fold away
    for (int trial = 0; trial < 10; ++trial) {
      const RadianceFunction p = to_harmonics(random_radiance(random, RadianceBasis::polynomials, degree, n));
      EXPECT_NEAR(product(degree, n, left, p.coefficients), 0, kFloat) << degree;
    }
    const LightField twice = kept(after, n);
    for (std::size_t i = 0; i < left.size(); ++i) EXPECT_NEAR(twice.coefficients[i], after.coefficients[i], kFloat);
  }
}

}  // namespace
}  // namespace kiln
