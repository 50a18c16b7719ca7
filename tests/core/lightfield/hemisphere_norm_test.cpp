#include "core/lightfield/hemisphere_norm.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "core/lightfield/light_field.h"
#include "tests/core/lightfield/random_radiance.h"

namespace kiln {
namespace {

using testing::random_direction;
using testing::random_radiance;

std::vector<double> only(std::size_t channel, std::size_t count, const std::vector<double>& c) {
  std::vector<double> rgb(3 * count);
  std::copy(c.begin(), c.end(), rgb.begin() + static_cast<std::ptrdiff_t>(channel * count));
  return rgb;
}

std::vector<Vec3d> normals() {
  std::vector<Vec3d> out{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}, normalized(Vec3d{1e-9, -1e-9, -1})};
  Random random(1, 0);
  while (out.size() < 12) out.push_back(random_direction(random));
  return out;
}

TEST(HemisphereNorm, OfAConstantIsItsValueSoThatDiffuseDistanceIsColourDistance) {
  for (int degree = 0; degree <= kMaxLightFieldDegree; ++degree) {
    const HemisphereNorm norm(degree);
    std::vector<double> rgb(3 * norm.count());
    const double y0 = std::sqrt(1 / (4 * std::numbers::pi));
    rgb[0] = 0.5 / y0, rgb[norm.count()] = -2 / y0, rgb[2 * norm.count()] = 3 / y0;
    for (const Vec3d& n : normals()) EXPECT_NEAR(squared_norm(norm, n, rgb), 0.25 + 4 + 9, 1e-12) << degree;
  }
}

TEST(HemisphereNorm, OfTheCosineIsAThird) {
  const HemisphereNorm norm(4);
  for (const Vec3d& n : normals()) {
    std::vector<double> c(norm.count());
    const double y1 = std::sqrt(3 / (4 * std::numbers::pi));
    c[1] = n.y / y1, c[2] = n.z / y1, c[3] = n.x / y1;  // n.w
    EXPECT_NEAR(squared_norm(norm, n, only(1, norm.count(), c)), 1.0 / 3, 1e-13);
  }
}

TEST(HemisphereNorm, EqualsQuadratureForEveryHarmonic) {
  for (int degree = 0; degree <= kMaxLightFieldDegree; ++degree) {
    const HemisphereNorm norm(degree);
    for (const Vec3d& n : normals()) {
      for (std::size_t i = 0; i < norm.count(); ++i) {
        std::vector<double> c(norm.count());
        c[i] = 1;
        const double exact = squared_norm_by_quadrature(degree, n, only(i % 3, norm.count(), c));
        EXPECT_NEAR(squared_norm(norm, n, only(i % 3, norm.count(), c)), exact, 1e-9 * exact);
      }
    }
  }
}

/// Eigenvectors of the Gram matrix, the weakest first.
Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes_of(const HemisphereNorm& norm, const Vec3d& n) {
  const std::size_t count = norm.count();
  std::vector<double> unit(count * count);
  for (std::size_t i = 0; i < count; ++i) unit[i * count + i] = 1;
  norm.to_coordinates(n, count, unit.data());
  const auto size = static_cast<Eigen::Index>(count);
  const Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> factor(unit.data(), size,
                                                                                                  size);
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(factor.transpose() * factor);
}

TEST(HemisphereNorm, EqualsQuadratureInEveryModeAlsoTheWeakest) {
  for (const int degree : {1, 2, 4, 6, 8}) {
    const HemisphereNorm norm(degree);
    for (const Vec3d& n : normals()) {
      const auto modes = modes_of(norm, n);
      for (Eigen::Index k = 0; k < modes.eigenvectors().cols(); ++k) {
        const Eigen::VectorXd v = modes.eigenvectors().col(k);
        const std::vector<double> rgb = only(2, norm.count(), {v.data(), v.data() + v.size()});
        const double exact = squared_norm_by_quadrature(degree, n, rgb);
        // The promise of issue 6. Measured: 4e-14 at degree 4, 2e-11 at degree 8.
        EXPECT_NEAR(squared_norm(norm, n, rgb) / exact, 1, 1e-6) << "degree " << degree << ", mode " << k;
      }
      // That the weakest are as weak as NOTES.md found, so that this tests what it says.
      const double weakest = modes.eigenvalues()[0] * 2 * std::numbers::pi;
      if (degree == 4) {
        EXPECT_LT(weakest, 1e-5);
      }
      if (degree == 8) {
        EXPECT_LT(weakest, 1e-10);
      }
    }
  }
}

TEST(HemisphereNorm, DotProductsOfCoordinatesAreThoseOfThePolarisedNorm) {
  Random random(2, 0);
  const HemisphereNorm norm(6);
  const Vec3d n = random_direction(random);
  const std::size_t count = norm.count();
  std::vector<double> columns(count * 2), a(count), b(count), sum(count);
  for (std::size_t i = 0; i < count; ++i) {
    columns[2 * i] = a[i] = random.uniform_double() - 0.5;
    columns[2 * i + 1] = b[i] = random.uniform_double() - 0.5;
    sum[i] = a[i] + b[i];
  }
  norm.to_coordinates(n, 2, columns.data());
  double product = 0;
  for (std::size_t i = 0; i < count; ++i) product += columns[2 * i] * columns[2 * i + 1];
  const auto squared = [&](const std::vector<double>& c) {
    return squared_norm_by_quadrature(6, n, only(0, count, c));
  };
  EXPECT_NEAR(product, 0.5 * (squared(sum) - squared(a) - squared(b)), 1e-12);
}

TEST(HemisphereNorm, DistanceIsAMetricThatTurnsWithTheFunctions) {
  Random random(3, 0);
  const HemisphereNorm norm(4);
  const auto field = [&] {
    std::vector<float> c(3 * norm.count());
    for (float& x : c) x = random.uniform() - 0.5F;
    return c;
  };
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3d n = random_direction(random);
    const auto a = field(), b = field(), c = field();
    const auto distance = [&](const auto& x, const auto& y) { return std::sqrt(squared_distance(norm, n, x, y)); };
    EXPECT_EQ(distance(a, a), 0);
    EXPECT_DOUBLE_EQ(distance(a, b), distance(b, a));
    EXPECT_LE(distance(a, c), distance(a, b) + distance(b, c));
    const Basis<double> turn = basis_around(random_direction(random));
    std::vector<double> before(a.begin(), a.end()), after = before;
    for (std::size_t k = 0; k < 3; ++k) {
      double* channel = after.data() + k * norm.count();
      rotate_sh(5, turn, channel, channel);
    }
    const double here = squared_norm(norm, n, before);
    EXPECT_NEAR(squared_norm(norm, turn.to_world(n), after), here, 1e-12 * here);
  }
}

TEST(HemisphereNorm, ReflectionKeepsIt) {
  Random random(4, 0);
  for (int degree = 0; degree <= kMaxLightFieldDegree; ++degree) {
    const HemisphereNorm norm(degree);
    const Vec3d n = random_direction(random);
    const RadianceFunction f = random_radiance(random, RadianceBasis::harmonics, degree, n);
    const double here = squared_norm(norm, n, f.coefficients);
    EXPECT_NEAR(squared_norm(norm, n, reflected(f).coefficients), here, 1e-12 * here);  // section 3.5
  }
}

}  // namespace
}  // namespace kiln
