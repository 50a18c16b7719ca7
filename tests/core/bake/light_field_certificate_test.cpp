// The certificate of a light field against errors that are known exactly: a glowing floor, and a file that shows
// something else.
#include "core/bake/light_field_certificate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/bake/field_views.h"
#include "core/base/random.h"

namespace kiln {
namespace {

constexpr std::uint32_t kSide = 100;                                      // squares
constexpr double kTriangles = 2.0 * kSide * kSide;                        // of the floor
constexpr std::uint32_t kMiddle = (kSide / 2) * (kSide + 1) + kSide / 2;  // a vertex with six triangles

/// A black floor that glows with radiance 1 towards every eye, and a file that shows just that.
BakedScene glowing_floor() {
  BakedScene out;
  Mesh& mesh = out.scene.mesh;
  for (std::uint32_t i = 0; i <= kSide; ++i) {
    for (std::uint32_t j = 0; j <= kSide; ++j) {
      mesh.position.push_back({static_cast<float>(i) / kSide - 0.5F, 0, static_cast<float>(j) / kSide - 0.5F});
      mesh.normal.push_back({0, 1, 0});
      if (i == 0 || j == 0) continue;
      const std::uint32_t v = i * (kSide + 1) + j, w = v - kSide - 1;
      mesh.triangles.push_back({w - 1, w, v});
      mesh.triangles.push_back({w - 1, v, v - 1});
    }
  }
  mesh.part.assign(mesh.triangles.size(), 0);
  out.scene.parts.push_back({.name = "floor"});
  Material glow;
  glow.base_color = {0, 0, 0, 1};
  glow.metallic = 0;
  glow.emission = {1, 1, 1};
  out.scene.materials.push_back(glow);
  out.field.degree = 0;
  out.field.coefficients.assign(3 * mesh.position.size(), static_cast<float>(2 * std::sqrt(std::numbers::pi)));
  return out;
}

void show(BakedScene& file, std::uint32_t vertex, float radiance) {
  for (float& c : file.field.of(vertex)) c = radiance * static_cast<float>(2 * std::sqrt(std::numbers::pi));
}

FieldCertificate certificate(const BakedScene& file, std::uint64_t seed) {
  Threads threads;
  const BakedScene input = glowing_floor();
  const Tracer truth(input.scene, threads);
  return certify_field({.decoded = file, .truth = truth, .environment = std::nullopt, .seed = seed}, threads);
}

TEST(LightFieldCertificate, OfAFileThatShowsTheTruthIsNothing) {
  const FieldCertificate c = certificate(glowing_floor(), 1);
  EXPECT_LT(c.radiance.relrmse, 1e-6);  // float32
  EXPECT_GE(c.points, 1000U);
}

TEST(LightFieldCertificate, FindsAHotSpotOfAThreeThousandthOfTheSurface) {
  // The mean square of a hat over its six triangles is a sixth of that of its height. Of 1024 even points three lie in
  // them, and the largest of three decides.
  constexpr double kHigh = 60;
  BakedScene file = glowing_floor();
  show(file, kMiddle, static_cast<float>(kHigh));
  const double error = (kHigh - 1) * std::sqrt(1 / kTriangles);
  int held = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const ErrorStats e = certificate(file, seed).radiance;
    held += e.interval_low <= error && error <= e.interval_high;
    EXPECT_NEAR(e.relrmse, error, 0.35 * error) << seed;  // a spread of a tenth was measured
  }
  EXPECT_GE(held, 8);  // of an interval of 95 % fewer have a chance of one in a hundred
}

TEST(LightFieldCertificate, CountsDarkErrorsByTheirArea) {
  BakedScene file = glowing_floor();
  for (std::uint32_t v = 0; v < kSide / 2 * (kSide + 1); ++v) show(file, v, 0);
  // Half of the floor is black, the row of squares at the border falls off: a third of it.
  const double error = std::sqrt((kSide / 2.0 - 1 + 1.0 / 3) / kSide);
  const ErrorStats e = certificate(file, 3).radiance;
  EXPECT_NEAR(e.relrmse, error, 0.05 * error);  // 4096 points and more: 2 %
  EXPECT_LE(e.interval_low, error);
  EXPECT_GE(e.interval_high, error);
}

TEST(FieldViews, ChosenOnesStandForAllInTheMean) {
  std::vector<FieldView> all(5000);
  double sum = 0;
  const auto value = [](const FieldView& v) { return v.view.x; };
  for (std::size_t i = 0; i < all.size(); ++i) {
    Random random(1, i);
    const double b = std::pow(random.uniform_double(), -0.7);  // heavy
    all[i].shown = {b, b, b};
    all[i].view = {random.uniform_double() * b * b, 0, 0};
    sum += value(all[i]);
  }
  constexpr int kRuns = 400;
  double mean = 0, squares = 0, count = 0;
  for (int run = 0; run < kRuns; ++run) {
    double estimate = 0, number = 0;
    const std::vector<FieldView> chosen = choose_views(all, 300, static_cast<std::uint64_t>(run));
    for (const FieldView& v : chosen) {
      EXPECT_GE(v.weight, 1);
      estimate += v.weight * value(v), number += v.weight;
    }
    EXPECT_NEAR(static_cast<double>(chosen.size()), 300, 1);
    mean += estimate / kRuns, squares += estimate * estimate / kRuns, count += number / kRuns;
  }
  const double error = std::sqrt((squares - mean * mean) / kRuns);
  EXPECT_NEAR(mean, sum, 4 * error);
  EXPECT_LT(error, 0.01 * sum);  // 300 even ones: .03 of it
  EXPECT_NEAR(count, static_cast<double>(all.size()), 0.02 * static_cast<double>(all.size()));
}

}  // namespace
}  // namespace kiln
