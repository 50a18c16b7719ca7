#include "core/prt/lobe_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"
#include "core/trace/ggx.h"

namespace kiln {
namespace {

Vec3d view_of(double nv) { return {std::sqrt(1 - nv * nv), 0, nv}; }

/// f(l) over the upper hemisphere by the midpoint rule in the mirrored half vector's own coordinates: brute force, no
/// importance sampling. Spherical coordinates around the mirror direction, denser near it (angle = pi s^3).
template <class F>
double around_mirror(const Vec3d& v, const F& f) {
  constexpr int kSteps = 600;
  const Basis<double> basis = basis_around(Vec3d{-v.x, -v.y, v.z});
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double s = (i + 0.5) / kSteps, angle = std::numbers::pi * s * s * s;
    const double ring = std::sin(angle) * 3 * std::numbers::pi * s * s / kSteps * 2 * std::numbers::pi / kSteps;
    for (int j = 0; j < kSteps; ++j) {
      const double phi = 2 * std::numbers::pi * (j + 0.5) / kSteps;
      const Vec3d l =
          basis.to_world({std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), std::cos(angle)});
      if (l.z > 0) sum += ring * f(l);
    }
  }
  return sum;
}

TEST(Ggx, DrawnDirectionsHaveTheDensityAndTheWeightThatTheFormulasSay) {
  for (const double roughness : {0.3, 0.6, 1.0}) {
    for (const double nv : {0.1, 0.5, 1.0}) {
      const double alpha = ggx_alpha(roughness);
      const Vec3d v = view_of(nv);
      // The density integrates to the share of samples above the surface.
      const double above = around_mirror(v, [&](const Vec3d& l) { return ggx_density(alpha, v, l); });
      double drawn = 0, reflected = 0;
      constexpr int kSide = 128;
      for (int i = 0; i < kSide * kSide; ++i) {
        const GgxSample s = sample_ggx(alpha, v, {(i / kSide + 0.5) / kSide, (i % kSide + 0.5) / kSide});
        if (s.l.z > 0) drawn += 1.0 / (kSide * kSide);
        reflected += s.weight / (kSide * kSide);
        if (s.weight > 0) {
          EXPECT_NEAR(s.weight * ggx_density(alpha, v, s.l), ggx_cosine(alpha, v, s.l),
                      1e-9 * (1 + ggx_cosine(alpha, v, s.l)));
        }
      }
      // A step of the grids along the horizon: 1 / 128 of the samples at most, less of the weight there.
      EXPECT_NEAR(drawn, above, 0.01);
      EXPECT_NEAR(reflected, around_mirror(v, [&](const Vec3d& l) { return ggx_cosine(alpha, v, l); }), 0.003);
    }
  }
}

TEST(Ggx, IsReciprocal) {
  Random random(1, 2);
  for (int i = 0; i < 100; ++i) {
    const double alpha = 0.05 + 0.9 * random.uniform_double();
    const Vec3d v = normalized(Vec3d{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() + 0.01});
    const Vec3d l = normalized(Vec3d{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() + 0.01});
    EXPECT_NEAR(ggx_cosine(alpha, v, l) / l.z / (ggx_cosine(alpha, l, v) / v.z), 1, 1e-9);
  }
}

TEST(LobeTable, DirectionalAlbedoIsTheIntegralOfTheBrdf) {
  const LobeTable table = make_lobe_table(5);
  double worst = 0, grazing = 0;
  for (const double roughness : {0.2, 0.37, 0.5, 0.63, 0.8, 1.0}) {
    for (const double nv : {0.02, 0.1, 0.25, 0.41, 0.7, 1.0}) {
      const double alpha = ggx_alpha(roughness), f0 = 0.3;
      const Vec3d v = view_of(nv);
      const double truth = around_mirror(
          v, [&](const Vec3d& l) { return (f0 + (1 - f0) * schlick_weight(v, l)) * ggx_cosine(alpha, v, l); });
      double& so_far = nv < 0.1 ? grazing : worst;
      so_far = std::max(so_far, std::abs(lobe_at(table, nv, roughness).albedo({f0, f0, f0}).x - truth));
    }
  }
  std::printf("worst directional albedo %.4f, within 6 degrees of grazing %.4f\n", worst, grazing);
  // Interpolation over columns 2.9 degrees apart and rows .067 apart; masking sets in abruptly at grazing.
  EXPECT_LT(worst, 0.01);
  EXPECT_LT(grazing, 0.03);
}

/// What arrives at an open point from z > 0 under light of these coefficients.
std::vector<Vec3d> above(int order, const std::vector<Vec3d>& light) {
  std::vector<Vec3d> out(light.size());
  std::vector<double> y(light.size());
  for (const QuadratureNode& node : gauss_legendre(16)) {
    const double z = (node.x + 1) / 2, r = std::sqrt(1 - z * z);
    for (int k = 0; k < 32; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / 32;
      evaluate_sh(order, Vec3d{r * std::cos(phi), r * std::sin(phi), z}, y.data());
      Vec3d radiance;
      for (std::size_t i = 0; i < y.size(); ++i) radiance += light[i] * y[i];
      for (std::size_t i = 0; i < y.size(); ++i)
        out[i] += radiance * (y[i] * node.weight / 2 * 2 * std::numbers::pi / 32);
    }
  }
  return out;
}

TEST(LobeTable, ASmoothSurfaceIsAMirrorAndARoughOneBlursTheHigherBandsAway) {
  const LobeTable table = make_lobe_table(5);
  double worst = 0, blurred = 0;
  for (const double nv : {0.05, 0.3, 0.6, 0.95, 1.0}) {
    const Vec3d v = view_of(nv), mirror{-v.x, 0, v.z};
    std::vector<double> y(25);
    evaluate_sh(5, mirror, y.data());
    const Lobe smooth = lobe_at(table, nv, 0), rough = lobe_at(table, nv, 1);
    EXPECT_NEAR(smooth.a + smooth.b, 1, 2e-3) << nv;  // nothing is masked
    for (std::size_t i = 1; i < 25; ++i) {
      std::vector<Vec3d> light(25);
      light[0] = {20, 20, 20};  // keeps it positive
      light[i].x += 1;
      const double level = 20 * 0.28209479177387814;
      worst = std::max(worst, std::abs(reflected_light(smooth, {0, 0, 1}, v, above(5, light).data()).x - level - y[i]));
      if (i >= 16)
        blurred = std::max(blurred, std::abs(reflected_light(rough, {0, 0, 1}, v, above(5, light).data()).x - level));
    }
  }
  std::printf("a mirror misses a harmonic by %.3f at worst; roughness 1 leaves %.3f of band 4\n", worst, blurred);
  EXPECT_LT(worst, 0.4);
  EXPECT_LT(blurred, 0.2);
}

TEST(LobeTable, ConstantLightIsReflectedWhole) {
  const LobeTable table = make_lobe_table(5);
  std::vector<Vec3d> light(25);
  light[0] = Vec3d{1, 2, 3} * (2 * std::sqrt(std::numbers::pi));
  const Vec3d out = reflected_light(lobe_at(table, 0.4, 0.5), {0, 0, 1}, view_of(0.4), above(5, light).data());
  EXPECT_LT(length(out - Vec3d{1, 2, 3}), 1e-5);  // floats of the table
}

/// Coefficients of light of mean 1; the others are spread evenly, as sharp light has them, with RMS `spread` over all
/// directions.
std::vector<Vec3d> random_light(int order, double spread, Random& random) {
  std::vector<Vec3d> out(static_cast<std::size_t>(sh_count(order)));
  double squared = 0;
  for (int l = 1; l < order; ++l) {
    for (int m = -l; m <= l; ++m) {
      double& x = out[static_cast<std::size_t>(l * (l + 1) + m)].x;
      x = 2 * random.uniform_double() - 1;
      squared += x * x;
    }
  }
  for (Vec3d& x : out) x = x * (spread * std::sqrt(4 * std::numbers::pi / squared));
  out[0] = {2 * std::sqrt(std::numbers::pi), 0, 0};
  return out;
}

/// RMS error over views and light of mean 1 and RMS spread 0.5: equation 1 against the GGX lobe, both as means of the
/// arriving light.
double lobe_error(const LobeTable& table, double roughness, double nv) {
  const Vec3d v = view_of(nv);
  const Lobe lobe = lobe_at(table, nv, roughness);
  Random random(7, static_cast<std::uint64_t>(1000 * nv));
  std::vector<std::vector<Vec3d>> lights;
  for (int trial = 0; trial < 50; ++trial) lights.push_back(random_light(table.order, 0.5, random));
  std::vector<double> y(static_cast<std::size_t>(sh_count(table.order))), moment(y.size());
  double all = 0, squared = 0;
  constexpr int kSide = 200;
  for (int i = 0; i < kSide * kSide; ++i) {
    const GgxSample s = sample_ggx(ggx_alpha(roughness), v, {(i / kSide + 0.5) / kSide, (i % kSide + 0.5) / kSide});
    if (!(s.weight > 0)) continue;
    evaluate_sh(table.order, s.l, y.data());
    all += s.weight;
    for (std::size_t k = 0; k < y.size(); ++k) moment[k] += s.weight * y[k];
  }
  for (const auto& light : lights) {
    double truth = 0;
    for (std::size_t k = 0; k < y.size(); ++k) truth += light[k].x * moment[k] / all;
    const double error = reflected_light(lobe, {0, 0, 1}, v, above(table.order, light).data()).x - std::max(0.0, truth);
    squared += error * error / static_cast<double>(lights.size());
  }
  return std::sqrt(squared);
}

TEST(LobeTable, FollowsTheGgxLobeUnderRandomLight) {
  const LobeTable table = make_lobe_table(5);
  for (const double roughness : {0.1, 0.25, 0.4, 0.5, 0.7, 0.9, 1.0}) {
    std::printf("roughness %.2f:", roughness);
    for (const double nv : {0.05, 0.1, 0.3, 0.5, 0.7, 0.9}) {
      const double error = lobe_error(table, roughness, nv);
      std::printf(" %.4f", error);
      EXPECT_LT(error, 0.1) << roughness << ' ' << nv;
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace kiln
