// The multilevel Shepard basis: partition of unity, convergence, fallback.

#include "core/meshless/basis.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/sphere/sampling.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln {
namespace {

/// Random places of a sphere about the origin with its normals.
std::vector<SurfaceSite> sphere_sites(int count, float radius, std::uint64_t seed) {
  std::vector<SurfaceSite> out;
  for (int i = 0; i < count; ++i) {
    const Vec3f n = to_float(uniform_sphere([&] {
      Random r(seed, static_cast<std::uint64_t>(i));
      const double a = r.uniform_double();
      return Vec2<double>{a, r.uniform_double()};
    }()));
    out.push_back({n * radius, n});
  }
  return out;
}

struct Fixture {
  Threads threads{2};
  Scene scene = testing::empty_scene();
  PointHierarchy h;
  std::vector<SurfaceSite> sites;

  explicit Fixture(std::uint64_t wanted = 4000) {
    testing::add_sphere(scene, {}, 0.4F, 40);
    const Tracer tracer(scene, threads);
    h = place_points(tracer, GatherFaces(scene), {.wanted = wanted}, threads);
    for (const MeshlessPoint& p : h.points) sites.push_back(p.site);
  }
  MeshlessBasis basis() { return {sites, h.level_end, threads}; }
};

float smooth(const SurfaceSite& p) {
  return 2 + std::sin(7 * p.position.x) * std::cos(5 * p.position.y) + p.position.z;
}

TEST(MeshlessBasis, FallsOffAsEquation13) {
  EXPECT_EQ(falloff(0), 1);
  EXPECT_FLOAT_EQ(falloff(0.5F), 0.5F);
  EXPECT_EQ(falloff(1), 0);
  EXPECT_EQ(falloff(3), 0);
}

TEST(MeshlessBasis, FunctionsOfEachLevelSumToOne) {
  Fixture f;
  const MeshlessBasis basis = f.basis();
  for (const SurfaceSite& p : sphere_sites(500, 0.4F, 3)) {
    std::vector<BasisTerm> terms;
    ASSERT_EQ(basis.terms(p, basis.levels(), terms), Cover::functions);
    std::vector<double> sum(basis.levels());
    for (const BasisTerm& t : terms) {
      EXPECT_GT(t.value, 0);
      std::size_t level = 0;
      while (t.function >= f.h.level_end[level]) ++level;
      sum[level] += t.value;
    }
    for (const double s : sum) EXPECT_NEAR(s, 1, 1e-5);  // rounding of about 10 terms
  }
}

TEST(MeshlessBasis, AboutKFunctionsOfALevelCoverAPoint) {
  Fixture f;
  const MeshlessBasis basis = f.basis();
  double count = 0;
  for (const SurfaceSite& p : sphere_sites(500, 0.4F, 4)) {
    std::vector<BasisTerm> terms;
    basis.terms(p, basis.levels(), terms);
    count += static_cast<double>(terms.size()) / 500;
  }
  // The k-th neighbour lies on the rim: the mean ball holds k + 1/2 points by its own middle. (4.1: "roughly kL".)
  EXPECT_NEAR(count / static_cast<double>(basis.levels()), MeshlessBasis::kNeighbours, 2);
}

TEST(MeshlessBasis, ReproducesConstantsWithTheCoarsestLevelAlone) {
  Fixture f;
  const MeshlessBasis basis = f.basis();
  const std::vector<Vec3f> alpha = basis.coefficients(std::vector<Vec3f>(f.sites.size(), Vec3f{3, 2, 1}), f.threads);
  for (std::size_t j = f.h.level_end[0]; j < alpha.size(); ++j) EXPECT_LT(length(alpha[j]), 1e-5F);
  for (const SurfaceSite& p : sphere_sites(200, 0.4F, 5)) {
    EXPECT_LT(length(basis.evaluate(alpha, p, basis.levels()) - Vec3f{3, 2, 1}), 1e-5F);
  }
}

TEST(MeshlessBasis, ConvergesLevelByLevel) {
  Fixture f(8000);
  const MeshlessBasis basis = f.basis();
  std::vector<Vec3f> values;
  for (const SurfaceSite& p : f.sites) values.push_back(Vec3f{1, 1, 1} * smooth(p));
  const std::vector<Vec3f> alpha = basis.coefficients(values, f.threads);
  double before = 1e9;
  for (std::size_t levels = 1; levels <= basis.levels(); ++levels) {
    double error = 0;
    for (const SurfaceSite& p : sphere_sites(1000, 0.4F, 6)) {
      error += std::pow(basis.evaluate(alpha, p, levels).x - smooth(p), 2) / 1000;
    }
    error = std::sqrt(error);
    // A Shepard step is of second order where points lie evenly, the multilevel remainder as well: .45 and less was
    // measured, .7 is asked for.
    EXPECT_LT(error, before * 0.7) << levels;
    before = error;
  }
  EXPECT_LT(before, 0.005);  // of a mean of 2
}

TEST(MeshlessBasis, DifferencesGiveTheValuesBack) {
  Fixture f;
  const MeshlessBasis basis = f.basis();
  std::vector<Vec3f> values;
  for (std::size_t j = 0; j < f.sites.size(); ++j) {
    Random random(8, j);
    values.push_back({random.uniform(), random.uniform(), random.uniform()});
  }
  const std::vector<Vec3f> alpha = basis.coefficients(values, f.threads);
  std::size_t level = 0;
  for (std::size_t j = 0; j < values.size(); ++j) {
    while (j >= f.h.level_end[level]) ++level;
    const Vec3f again = alpha[j] + basis.evaluate(alpha, f.sites[j], level);  // equation 10
    EXPECT_LT(length(again - values[j]), 1e-6F) << j;
  }
}

TEST(MeshlessBasis, CoefficientsAreTheSameForAnyThreadCount) {
  Fixture f;
  std::vector<Vec3f> values;
  for (const SurfaceSite& p : f.sites) values.push_back(p.position);
  Threads one(1), three(3);
  const MeshlessBasis a(f.sites, f.h.level_end, one), b(f.sites, f.h.level_end, three);
  EXPECT_EQ(a.coefficients(values, one), b.coefficients(values, three));
}

TEST(MeshlessBasis, HasNoTermsFromBehind) {
  Fixture f;
  const MeshlessBasis basis = f.basis();
  for (SurfaceSite p : sphere_sites(100, 0.4F, 7)) {
    std::vector<BasisTerm> terms;
    basis.terms(p, basis.levels(), terms);
    for (const BasisTerm& t : terms) EXPECT_GT(dot(f.sites[t.function].normal, p.normal), 0);
  }
}

TEST(MeshlessBasis, TakesTheNearestCompatiblePointWhereNothingReaches) {
  Threads threads(1);
  std::vector<SurfaceSite> sites;
  for (int i = 0; i < 12; ++i) sites.push_back({{0.01F * static_cast<float>(i), 0, 0}, {0, 1, 0}});
  sites.push_back({{0.4F, 0, 0}, {0, -1, 0}});  // nearer to what is asked, but it looks away
  const std::uint32_t end[] = {13};
  const MeshlessBasis basis(sites, end, threads);
  std::vector<BasisTerm> terms;
  ASSERT_EQ(basis.terms({{0.45F, 0, 0}, {0, 1, 0}}, 1, terms), Cover::nearest);
  ASSERT_EQ(terms.size(), 1U);
  EXPECT_EQ(terms[0].function, 11U);
  EXPECT_EQ(terms[0].value, 1);
  EXPECT_EQ(basis.nearest({{0.45F, 0, 0}, {0, 1, 0}}, 0), 11U);
  terms.clear();
  EXPECT_EQ(basis.terms({{0.45F, 0, 0}, {0, 1, 0}, 7}, 1, terms), Cover::none);  // a group without points
  EXPECT_EQ(basis.nearest({{0.45F, 0, 0}, {0, 1, 0}, 7}, 0), MeshlessBasis::kNoFunction);
  EXPECT_EQ(basis.evaluate(std::vector<Vec3f>(13, {1, 1, 1}), {{0.45F, 0, 0}, {1, 0, 0}}, 1), Vec3f{});
}

TEST(MeshlessBasis, FewerPointsThanNeighboursReachOverTheScene) {
  Threads threads(1);
  const std::vector<SurfaceSite> sites = {{{0, 0, 0}, {0, 1, 0}}, {{0.1F, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 1, 0}}};
  const std::uint32_t end[] = {3};
  const MeshlessBasis basis(sites, end, threads);
  std::vector<BasisTerm> terms;
  ASSERT_EQ(basis.terms({{0.5F, 0.5F, 0.5F}, {0, 1, 0}}, 1, terms), Cover::functions);
  EXPECT_EQ(terms.size(), 3U);
  const MeshlessBasis none({}, {}, threads);
  EXPECT_EQ(none.terms({}, 1, terms), Cover::none);
}

TEST(MeshlessBasis, PointsOnOneAnotherDivideByNothing) {
  Threads threads(1);
  const std::vector<SurfaceSite> sites(30, {{0.1F, 0.1F, 0.1F}, {0, 1, 0}});
  const std::uint32_t end[] = {30};
  const MeshlessBasis basis(sites, end, threads);
  const std::vector<Vec3f> ones(30, {1, 1, 1});
  for (const float x : {0.1F, 0.1000005F, 0.1001F, 0.2F}) {
    EXPECT_NEAR(basis.evaluate(ones, {{x, 0.1F, 0.1F}, {0, 1, 0}}, 1).x, 1, 1e-5) << x;
  }
}

TEST(SphereTree, FindsExactlyTheBallsThatHoldAPoint) {
  for (const std::size_t count : {1U, 7U, 8U, 9U, 300U}) {
    std::vector<Ball> balls;
    for (std::size_t i = 0; i < count; ++i) {
      Random r(11, i);
      balls.push_back(
          {{r.uniform() - 0.5F, r.uniform() - 0.5F, r.uniform() - 0.5F}, 0.02F + 0.4F * r.uniform() * r.uniform()});
    }
    const SphereTree tree(balls);
    for (std::size_t q = 0; q < 200; ++q) {
      Random r(12, q);
      const Vec3f p{r.uniform() - 0.5F, r.uniform() - 0.5F, r.uniform() - 0.5F};
      std::vector<int> found(count), expected(count);
      tree.containing(p, [&](std::uint32_t i, float) { ++found[i]; });
      for (std::size_t i = 0; i < count; ++i) {
        const Vec3f d = balls[i].center - p;
        expected[i] = dot(d, d) < balls[i].radius * balls[i].radius ? 1 : 0;
      }
      ASSERT_EQ(found, expected);
    }
  }
}

}  // namespace
}  // namespace kiln
