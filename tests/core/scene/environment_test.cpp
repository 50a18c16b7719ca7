#include "core/scene/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;

/// A map of random texels: rough enough that any mistake in the weights shows.
Environment random_map(int width, int height, std::uint64_t seed) {
  Environment e{.name = "random", .width = width, .height = height, .radiance = {}};
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(width * height); ++i) {
    Random random(seed, i);
    e.radiance.push_back({random.uniform(), random.uniform(), random.uniform()});
  }
  return e;
}

/// Midpoint rule over the sphere through environment_radiance itself: slow, and simple enough to be right.
std::vector<Vec3d> integrate(const Environment& e, int order, int steps) {
  std::vector<Vec3d> sum(static_cast<std::size_t>(sh_count(order)));
  std::vector<double> y(sum.size());
  for (int j = 0; j < steps; ++j) {
    const double theta = kPi * (j + 0.5) / steps;
    for (int i = 0; i < 2 * steps; ++i) {
      const double phi = kPi * (i + 0.5) / steps;
      const Vec3d w{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
      const Vec3d radiance = to_double(environment_radiance(e, to_float(w)));
      evaluate_sh(order, w, y.data());
      for (std::size_t k = 0; k < sum.size(); ++k)
        sum[k] += radiance * (y[k] * std::sin(theta) * kPi * kPi / steps / steps);
    }
  }
  return sum;
}

double largest_difference(const std::vector<Vec3f>& a, const std::vector<Vec3d>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, length(to_double(a[i]) - b[i]));
  return worst;
}

TEST(Environment, LookupFollowsTheEquirectangularConvention) {
  // Four columns: u = 1/8, 3/8, 5/8, 7/8, that is longitudes -135, -45, 45, 135 degrees in x = cos, z = sin.
  const Environment e{.name = "", .width = 4, .height = 1, .radiance = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}}};
  const float h = std::sqrt(0.5F);
  EXPECT_NEAR(environment_radiance(e, {-h, 0, -h}).x, 1, 1e-6);
  EXPECT_NEAR(environment_radiance(e, {h, 0, -h}).x, 2, 1e-6);
  EXPECT_NEAR(environment_radiance(e, {h, 0, h}).x, 3, 1e-6);
  EXPECT_NEAR(environment_radiance(e, {-h, 0, h}).x, 4, 1e-6);
  EXPECT_NEAR(environment_radiance(e, {1, 0, 0}).x, 2.5, 1e-6);
  EXPECT_NEAR(environment_radiance(e, {-1, 0, 0}).x, 2.5, 1e-6) << "the seam at u = 0 wraps";
}

TEST(Environment, TopRowIsUp) {
  const Environment e{.name = "", .width = 1, .height = 2, .radiance = {{1, 1, 1}, {0, 0, 0}}};
  EXPECT_FLOAT_EQ(environment_radiance(e, {0, 1, 0}).x, 1);
  EXPECT_FLOAT_EQ(environment_radiance(e, {0, -1, 0}).x, 0);
  EXPECT_NEAR(environment_radiance(e, {1, 0, 0}).x, 0.5, 1e-6);
}

TEST(Environment, PositiveRotationTurnsPlusZTowardsPlusX) {
  Environment e = random_map(64, 32, 1);
  const Vec3f before = environment_radiance(e, {0, 0.6F, 0.8F});
  e.rotation_deg = 90;
  const Vec3f after = environment_radiance(e, {0.8F, 0.6F, 0});
  EXPECT_NEAR(length(after - before), 0, 1e-5);  // float directions times 64 texels
}

TEST(Environment, ConstantSkyProjectsOnTheFirstCoefficientAlone) {
  const auto c = project_environment(constant_sky({1, 2, 3}), 6);
  EXPECT_NEAR(c[0].x, 2 * std::sqrt(kPi), 1e-6);
  EXPECT_NEAR(c[0].y, 4 * std::sqrt(kPi), 1e-6);
  EXPECT_NEAR(c[0].z, 6 * std::sqrt(kPi), 1e-6);
  for (std::size_t i = 1; i < c.size(); ++i) EXPECT_NEAR(length(c[i]), 0, 1e-6) << i;
}

TEST(Environment, ProjectionIntegratesTheBilinearMapItself) {
  // 16 x 8 random texels; the midpoint rule at 1024 x 2048 is right to 1e-5 (it halves its error fourfold per doubling:
  // 6e-5 at 512 steps), coefficients are of size 1.
  Environment e = random_map(16, 8, 2);
  e.rotation_deg = 33;
  e.intensity = 1.5F;
  EXPECT_LT(largest_difference(project_environment(e, 10), integrate(e, 10, 1024)), 5e-5);
}

TEST(Environment, ProjectionIsRightForOddSizes) {
  for (const auto& [width, height] : {std::pair{1, 2}, {2, 1}, {3, 5}}) {
    const Environment e = random_map(width, height, 3);
    EXPECT_LT(largest_difference(project_environment(e, 4), integrate(e, 4, 512)), 2e-4) << width << " x " << height;
  }
}

TEST(Environment, ProjectionReproducesAPolynomialOfTheSameDegree) {
  // The map samples 1 + x + y z on 512 x 256 texels; bilinear interpolation of it errs by (pi/256)^2 / 8 = 2e-5.
  Environment e{.name = "", .width = 512, .height = 256, .radiance = {}};
  for (int j = 0; j < 256; ++j) {
    for (int i = 0; i < 512; ++i) {
      const double phi = 2 * kPi * ((i + 0.5) / 512 - 0.5), theta = kPi * (j + 0.5) / 256;
      const double x = std::sin(theta) * std::cos(phi), y = std::cos(theta), z = std::sin(theta) * std::sin(phi);
      const auto l = static_cast<float>(1 + x + y * z);
      e.radiance.push_back({l, l, l});
    }
  }
  const auto c = project_environment(e, 3);
  std::vector<double> want(9);
  want[0] = 2 * std::sqrt(kPi);               // 1 = 2 sqrt(pi) Y00
  want[3] = std::sqrt(4 * kPi / 3);           // x
  want[5] = 1 / (0.5 * std::sqrt(15 / kPi));  // y z
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(c[i].x, want[i], 1e-4) << i;
}

TEST(Environment, RotatingTheMapRotatesTheCoefficients) {
  Environment e = random_map(32, 16, 4);
  const auto at_rest = project_environment(e, 2);
  e.rotation_deg = 90;
  const auto turned = project_environment(e, 2);
  EXPECT_NEAR(turned[3].x, at_rest[2].x, 1e-5) << "what was along +Z is along +X";
  EXPECT_NEAR(turned[1].x, at_rest[1].x, 1e-5) << "+Y stays";
}

TEST(Environment, OvercastSkyLightsALevelPlaneByTheClosedForm) {
  // Irradiance of (1 + 2 sin g) / 3 on a level plane: 7 pi / 9. Texels of 1.4 degrees: 1e-3.
  const Environment e = overcast_sky();
  double irradiance = 0;
  const int n = 400;
  for (int j = 0; j < n; ++j) {
    const double theta = kPi / 2 * (j + 0.5) / n;
    irradiance += environment_radiance(e, to_float(Vec3d{std::sin(theta), std::cos(theta), 0})).x * std::cos(theta) *
                  std::sin(theta) * 2 * kPi * (kPi / 2 / n);
  }
  EXPECT_NEAR(irradiance, 7 * kPi / 9, 3e-3);
  EXPECT_NEAR(environment_radiance(e, {0, -1, 0}).x, 0.2 / 3, 1e-6);
}

TEST(Environment, ClearSkyHasItsSunWhereItSays) {
  const Environment e = clear_sky_with_sun();
  const float h = std::sqrt(0.5F);
  const Vec3f at_sun = environment_radiance(e, {0.5F, h, 0.5F});
  EXPECT_GT(at_sun.x, 1000);
  for (const Vec3f& c : e.radiance) {
    EXPECT_TRUE(is_finite(c));
    EXPECT_GT(c.x, 0);
  }
}

TEST(Environment, ProjectionIsLinearInLight) {
  const Environment a = random_map(16, 8, 5), b = random_map(16, 8, 6);
  Environment sum = a;
  for (std::size_t i = 0; i < sum.radiance.size(); ++i) sum.radiance[i] += b.radiance[i] * 2.0F;
  const auto pa = project_environment(a, 5), pb = project_environment(b, 5), ps = project_environment(sum, 5);
  for (std::size_t i = 0; i < ps.size(); ++i) EXPECT_NEAR(length(ps[i] - pa[i] - pb[i] * 2.0F), 0, 1e-5) << i;
}

}  // namespace
}  // namespace kiln
