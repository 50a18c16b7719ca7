#include "core/lightfield/visibility_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

Vec3f direction(std::uint64_t k) {
  Random random(3, k);
  const double z = random.uniform_double(), phi = 6.283185307179586 * random.uniform_double();
  const double r = std::sqrt(1 - z * z);
  return to_float(Vec3d{r * std::cos(phi), r * std::sin(phi), z});
}

template <class Seen>
SkyVisibility fit(const Seen& seen) {
  VisibilityFit out;
  for (std::uint64_t k = 0; k < 2000; ++k) {
    const Vec3f w = direction(k);
    out.add(w, true, 1, seen(w));
  }
  return out.fit();
}

TEST(VisibilityFit, AllOrNothingIsExact) {
  const SkyVisibility all = fit([](const Vec3f&) { return true; }), none = fit([](const Vec3f&) { return false; });
  for (std::uint64_t k = 0; k < 50; ++k) {
    const Vec3d w = to_double(direction(1000 + k));
    EXPECT_NEAR(visibility_along(all, w), 1, 1e-6);  // floats
    EXPECT_EQ(visibility_along(none, w), 0);
  }
}

TEST(VisibilityFit, AWallHidesItsSide) {
  const SkyVisibility wall = fit([](const Vec3f& w) { return w.x < 0; });
  EXPECT_LT(visibility_along(wall, normalized(Vec3d{1, 0, 0.5})), 0.1);
  EXPECT_GT(visibility_along(wall, normalized(Vec3d{-1, 0, 0.5})), 0.9);
  EXPECT_NEAR(visibility_along(wall, {0, 0, 1}), 0.5, 0.1);
}

/// Where the sky is bright it matters more what is seen.
TEST(VisibilityFit, LeansTowardsTheLight) {
  const auto with_light = [](double bright) {
    VisibilityFit out;
    for (std::uint64_t k = 0; k < 2000; ++k) {
      const Vec3f w = direction(k);
      const bool lamp = dot(w, Vec3f{0.6F, 0, 0.8F}) > 0.97F;
      out.add(w, true, lamp ? bright : 1, lamp);  // a hole just where the lamp is
    }
    return visibility_along(out.fit(), {0.6, 0, 0.8});
  };
  EXPECT_GT(with_light(1000), 2 * with_light(1));
  EXPECT_GT(with_light(1000), 0.5);
}

TEST(VisibilityFit, OfNothingIsNothing) { EXPECT_EQ(VisibilityFit().fit(), SkyVisibility{}); }

}  // namespace
}  // namespace kiln
