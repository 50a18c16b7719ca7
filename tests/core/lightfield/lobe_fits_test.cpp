// Fits of lobes against the best series there is, found by least squares over quadrature nodes.
#include "core/lightfield/lobe_fits.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>

#include "core/artifact/import.h"
#include "core/base/random.h"
#include "core/prt/lobe_table.h"
#include "core/scene/environment.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"
#include "core/trace/environment_sampler.h"
#include "core/trace/ggx.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;

struct Arriving {
  Vec3d l;
  double light = 0;  // of a plane that faces l
};

/// Red of a sky above a surface that faces up, by many directions.
std::vector<Arriving> sky_light(const Environment& sky) {
  const EnvironmentSampler sampler(sky);
  std::vector<Arriving> out;
  constexpr int kCount = 4096;
  const auto turned = [](const Vec3d& w) { return Vec3d{w.x, w.z, w.y}; };  // up becomes z
  for (int k = 0; k < kCount; ++k) {
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), 7);
    for (const Vec3d& w : {sampler.sample({u.x, u.y}), uniform_sphere(Vec2<double>{u.x, u.y})}) {
      const double density = sampler.density(w) + 0.25 / kPi;
      if (w.y > 0) out.push_back({turned(w), environment_radiance(sky, to_float(w)).x / (density * kCount)});
    }
  }
  return out;
}

struct Eye {
  Vec3d v;
  double weight = 0;
};

std::vector<Eye> eyes_above() {
  std::vector<Eye> out;
  for (const QuadratureNode& n : gauss_legendre(24)) {
    const double z = (n.x + 1) / 2, r = std::sqrt(1 - z * z);
    for (int k = 0; k < 48; ++k)
      out.push_back({{r * std::cos(2 * kPi * k / 48), r * std::sin(2 * kPi * k / 48), z}, n.weight / 2 * 2 * kPi / 48});
  }
  return out;
}

double radiance(const std::vector<Arriving>& arriving, const Vec3d& v, double roughness, double f0) {
  double sum = 0;
  const double alpha = ggx_alpha(roughness);
  for (const Arriving& a : arriving)
    sum += a.light * (f0 + (1 - f0) * schlick_weight(v, a.l)) * ggx_cosine(alpha, v, a.l);
  return sum;
}

std::vector<float> fitted(const LobeFits& fits, const std::vector<Arriving>& arriving, double roughness, double f0) {
  const LobeFit fit = fits.at(roughness);
  LobeSum sum(fit);
  for (const Arriving& a : arriving) {
    const auto x = static_cast<float>(a.light);
    sum.add(to_float(a.l), {x, x, x});
  }
  std::vector<float> out(3 * static_cast<std::size_t>(sh_count(fits.degree() + 1)));
  const auto f = static_cast<float>(f0);
  sum.finish({f, f, f}, {}, 1, out);
  return out;
}

double value_of(const std::vector<float>& c, int degree, const Vec3d& v) {
  std::vector<double> y(static_cast<std::size_t>(sh_count(degree + 1)));
  evaluate_sh(degree + 1, {-v.x, -v.y, v.z}, y.data());  // an r-RF
  double sum = 0;
  for (std::size_t i = 0; i < y.size(); ++i) sum += double{c[i]} * y[i];
  return sum;
}

/// relRMSE over eyes of the given series, and of the best one.
struct Errors {
  double ours = 0, best = 0;
};

Errors errors_of(int degree, double roughness, double f0, const Environment& sky = clear_sky_with_sun()) {
  Threads threads(2);
  const LobeFits fits(degree, threads);
  const std::vector<Arriving> arriving = sky_light(sky);
  const std::vector<Eye> eyes = eyes_above();
  const std::vector<float> ours = fitted(fits, arriving, roughness, f0);
  const int n = sh_count(degree + 1);
  Eigen::MatrixXd rows(eyes.size(), n);
  Eigen::VectorXd truth(eyes.size()), y(n);
  double mean = 0, area = 0, squares = 0;
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const double x = radiance(arriving, eyes[i].v, roughness, f0), root = std::sqrt(eyes[i].weight);
    evaluate_sh(degree + 1, {-eyes[i].v.x, -eyes[i].v.y, eyes[i].v.z}, y.data());
    rows.row(static_cast<Eigen::Index>(i)) = root * y;
    truth[static_cast<Eigen::Index>(i)] = root * x;
    mean += eyes[i].weight * x, area += eyes[i].weight;
    squares += eyes[i].weight * std::pow(value_of(ours, degree, eyes[i].v) - x, 2);
  }
  const Eigen::VectorXd best = rows.colPivHouseholderQr().solve(truth);
  mean /= area;
  return {std::sqrt(squares / area) / mean, (rows * best - truth).norm() / std::sqrt(area) / mean};
}

TEST(LobeFits, AreWithinThreePercentOfTheBestSeriesOfTheirDegree) {
  // Issue 6 asks for a factor 1.03 at degree 8 and roughness .5.
  const Errors e = errors_of(8, 0.5, 1);
  EXPECT_LT(e.ours, 1.03 * e.best) << e.best;
  const Errors d = errors_of(4, 0.5, 0.04);
  EXPECT_LT(d.ours, 1.03 * d.best) << d.best;
  // Between two rows of the table.
  const Errors between = errors_of(8, 0.53, 1);
  std::printf("%.4f, best %.4f; %.4f, %.4f; %.4f, %.4f\n", e.ours, e.best, d.ours, d.best, between.ours, between.best);
  EXPECT_LT(between.ours, 1.03 * between.best) << between.best;
}

TEST(LobeFits, AreWithinThreePercentUnderRealSkies) {
  const std::filesystem::path folder = std::filesystem::path(KILN_SHARED) / "models/environments";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared models at " << folder;
  int skies = 0;
  for (const char* name : {"spiaggia_di_mondello_1k.hdr", "st_peters_square_night_1k.hdr",
                           "sepulchral_chapel_rotunda_1k.hdr", "courtyard.exr"}) {
    std::ifstream file(folder / name, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    const Result<Environment> sky = import_environment(bytes, name);
    ASSERT_TRUE(sky) << name;
    const Errors e = errors_of(8, 0.5, 1, *sky);
    std::printf("%s %.4f, best %.4f\n", name, e.ours, e.best);
    EXPECT_LT(e.ours, 1.03 * e.best) << name;  // issue 6
    ++skies;
  }
  EXPECT_EQ(skies, 4);
}

TEST(LobeFits, TurnWithTheLightAboutTheNormal) {
  Threads threads(2);
  const LobeFits fits(6, threads);
  const LobeFit fit = fits.at(0.4);
  const auto series = [&](double azimuth) {
    LobeSum sum(fit);
    sum.add(to_float(Vec3d{0.6 * std::cos(azimuth), 0.6 * std::sin(azimuth), 0.8}), {1, 1, 1});
    std::vector<float> out(3 * 49);
    sum.finish({1, 1, 1}, {}, 1, out);
    return out;
  };
  const std::vector<float> still = series(0), turned = series(1.1);
  for (const double a : {0.0, 0.7, 2.0, 4.5}) {
    const Vec3d v{0.8 * std::cos(a), 0.8 * std::sin(a), 0.6}, w{0.8 * std::cos(a + 1.1), 0.8 * std::sin(a + 1.1), 0.6};
    EXPECT_NEAR(value_of(still, 6, v), value_of(turned, 6, w), 1e-4);  // float, values about 1
  }
}

TEST(LobeFits, OfARangeAreThoseOfAllFinishes) {
  Threads threads(2);
  const LobeFits all(3, threads), few(3, threads, {0.3, 0.42}), one(3, threads, {1, 1});
  for (const double roughness : {0.3, 0.33, 0.375, 0.42}) {
    EXPECT_EQ(few.at(roughness).lobe, all.at(roughness).lobe);
    EXPECT_EQ(few.at(roughness).diffuse, all.at(roughness).diffuse);
  }
  EXPECT_EQ(one.at(1).lobe, all.at(1).lobe);
}

TEST(LobeFits, UnderAWhiteSkyShowTheDirectionalAlbedo) {
  Threads threads(2);
  const LobeFits fits(6, threads);
  const LobeTable table = make_lobe_table(1);
  std::vector<Arriving> white;
  for (int k = 0; k < 8192; ++k) {
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), 3);
    const double z = u.x, r = std::sqrt(1 - z * z);
    white.push_back({{r * std::cos(2 * kPi * u.y), r * std::sin(2 * kPi * u.y), z}, 2 * kPi / 8192});
  }
  for (const double roughness : {0.3, 0.6, 1.0}) {
    const std::vector<float> ours = fitted(fits, white, roughness, 0.2);
    for (const double nv : {0.3, 0.6, 0.95}) {
      const double truth = lobe_at(table, nv, roughness).albedo({0.2, 0.2, 0.2}).x;
      const double shown = value_of(ours, 6, {std::sqrt(1 - nv * nv), 0, nv});
      EXPECT_NEAR(shown, truth, 0.03) << roughness << ' ' << nv;  // six bands of a Fresnel rise: .02 measured
    }
  }
}

TEST(LobeFits, LeaveTheDiffuseLayerWhatTheSpecularOneDoesNotKeep) {
  Threads threads(2);
  const LobeFits fits(6, threads);
  const LobeTable table = make_lobe_table(1);
  const LobeFit fit = fits.at(0.5);
  const LobeSum sum(fit);
  std::vector<float> out(3 * 49);
  sum.finish({}, {0.5F, 0.25F, 1}, 1, out);
  for (const double nv : {0.4, 0.7, 1.0}) {
    const double truth = 1 - lobe_at(table, nv, 0.5).kept();
    EXPECT_NEAR(value_of(out, 6, {std::sqrt(1 - nv * nv), 0, nv}), 0.5 * truth, 0.01);
  }
  EXPECT_FLOAT_EQ(out[49], 0.5F * out[0]);
}

}  // namespace
}  // namespace kiln
