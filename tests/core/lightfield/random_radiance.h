#pragma once
// Random radiance functions.

#include "core/base/random.h"
#include "core/lightfield/radiance_function.h"
#include "core/sphere/sampling.h"

namespace kiln::testing {

inline Vec3d random_direction(Random& random) {
  return uniform_sphere({random.uniform_double(), random.uniform_double()});
}

inline Vec3d random_above(Random& random, const Vec3d& normal) {
  const Vec3d w = random_direction(random);
  return dot(w, normal) < 0 ? -w : w;
}

inline RadianceFunction random_radiance(Random& random, RadianceBasis basis, int degree, const Vec3d& normal) {
  RadianceFunction f{.basis = basis, .degree = degree, .normal = normal, .coefficients = {}};
  for (std::size_t i = 0; i < 3 * radiance_count(basis, degree); ++i)
    f.coefficients.push_back(random.uniform_double() - 0.5);
  return f;
}

}  // namespace kiln::testing
