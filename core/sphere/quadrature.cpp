#include "core/sphere/quadrature.h"

#include <cmath>
#include <numbers>

#include "core/base/expects.h"

namespace kiln {
namespace {

struct LegendreValue {
  double value, derivative;
};

LegendreValue legendre(int n, double x) {
  double before = 1, now = x;
  for (int k = 2; k <= n; ++k) {
    const double next = ((2 * k - 1) * x * now - (k - 1) * before) / k;
    before = now;
    now = next;
  }
  return {now, n * (x * now - before) / (x * x - 1)};
}

}  // namespace

std::vector<QuadratureNode> gauss_legendre(int count) {
  EXPECTS(count >= 1);
  std::vector<QuadratureNode> nodes;
  for (int i = 0; i < count; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));  // Tricomi's first guess
    for (int step = 0; step < 8; ++step) {                               // Newton doubles the digits of each step
      const auto [value, derivative] = legendre(count, x);
      x -= value / derivative;
    }
    const double derivative = legendre(count, x).derivative;
    nodes.push_back({x, 2 / ((1 - x * x) * derivative * derivative)});
  }
  return nodes;
}

std::vector<SphereNode> sphere_quadrature(int degree) {
  EXPECTS(degree >= 0);
  const int azimuths = degree + 1;
  std::vector<SphereNode> nodes;
  for (const QuadratureNode& ring : gauss_legendre(degree / 2 + 1)) {
    const double radius = std::sqrt(1 - ring.x * ring.x);
    for (int i = 0; i < azimuths; ++i) {
      const double phi = 2 * std::numbers::pi * (i + 0.5) / azimuths;
      nodes.push_back(
          {{radius * std::cos(phi), radius * std::sin(phi), ring.x}, ring.weight * 2 * std::numbers::pi / azimuths});
    }
  }
  return nodes;
}

}  // namespace kiln
