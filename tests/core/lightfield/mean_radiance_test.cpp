// The mean of a light field over the eyes above it.
#include "core/lightfield/mean_radiance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/core/lightfield/random_radiance.h"

namespace kiln {
namespace {

TEST(MeanRadiance, IsTheMeanOfWhatEyesSee) {
  Random random(5, 6);
  for (int degree = 0; degree <= kMaxLightFieldDegree; ++degree) {
    const Vec3d n = testing::random_direction(random);
    RadianceFunction f = testing::random_radiance(random, RadianceBasis::harmonics, degree, n);
    for (std::size_t c = 0; c < 3; ++c) f.coefficients[c * f.coefficients.size() / 3] = 9;  // above zero
    LightField field{.degree = degree, .coefficients = {}};
    for (const double c : f.coefficients) field.coefficients.push_back(static_cast<float>(c));
    Vec3d sum;
    constexpr int kRows = 64, kColumns = 64;  // midpoints in z and azimuth: exact in azimuth, 1e-4 in z
    const Basis<double> frame = basis_around(n);
    for (int i = 0; i < kRows; ++i) {
      for (int k = 0; k < kColumns; ++k) {
        const double z = (i + 0.5) / kRows, phi = 2 * std::numbers::pi * k / kColumns, r = std::sqrt(1 - z * z);
        sum += evaluate(f, frame.to_world({r * std::cos(phi), r * std::sin(phi), z}));
      }
    }
    sum = sum / double{kRows * kColumns};
    const Vec3f normal[] = {to_float(n)};
    const Vec3f mean = mean_radiance(field, normal)[0];
    EXPECT_NEAR(mean.x, sum.x, 2e-3);
    EXPECT_NEAR(mean.y, sum.y, 2e-3);
    EXPECT_NEAR(mean.z, sum.z, 2e-3);
  }
}

}  // namespace
}  // namespace kiln
