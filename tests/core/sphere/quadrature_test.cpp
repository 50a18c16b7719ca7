#include "core/sphere/quadrature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace kiln {
namespace {

TEST(Quadrature, GaussLegendreIntegratesPolynomialsOfItsDegreeExactly) {
  for (int count = 1; count <= 20; ++count) {
    for (int power = 0; power < 2 * count; ++power) {
      double sum = 0;
      for (const QuadratureNode& node : gauss_legendre(count)) sum += node.weight * std::pow(node.x, power);
      EXPECT_NEAR(sum, power % 2 == 0 ? 2.0 / (power + 1) : 0, 1e-14) << count << " nodes, power " << power;
    }
  }
}

TEST(Quadrature, SphereRuleHasTheMomentsOfTheSphere) {
  double area = 0, x2 = 0, x2y2z2 = 0;
  for (const SphereNode& node : sphere_quadrature(6)) {
    const Vec3d& w = node.direction;
    area += node.weight;
    x2 += node.weight * w.x * w.x;
    x2y2z2 += node.weight * w.x * w.x * w.y * w.y * w.z * w.z;
  }
  EXPECT_NEAR(area, 4 * std::numbers::pi, 1e-13);
  EXPECT_NEAR(x2, 4 * std::numbers::pi / 3, 1e-13);
  EXPECT_NEAR(x2y2z2, 4 * std::numbers::pi / 105, 1e-13);
}

}  // namespace
}  // namespace kiln
