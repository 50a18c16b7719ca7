#pragma once
// Integrals that are exact for polynomials: Gauss-Legendre in z, equal steps in azimuth.

#include <vector>

#include "core/base/vec.h"

namespace kiln {

struct QuadratureNode {
  double x = 0, weight = 0;
};

/// Nodes of [-1, 1] that integrate polynomials up to degree 2 count - 1 exactly. Error 1e-15.
std::vector<QuadratureNode> gauss_legendre(int count);

struct SphereNode {
  Vec3d direction;
  double weight = 0;  // all of them sum to 4 pi
};

/// Product rule on the sphere, exact for polynomials in x, y, z up to `degree`. About (degree + 1)^2 / 2 nodes.
std::vector<SphereNode> sphere_quadrature(int degree);

}  // namespace kiln
