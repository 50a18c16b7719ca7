#include "core/scene/bright_part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace kiln {
namespace {

TEST(BrightPart, IsDarknessWhereNothingIsBright) {
  for (const Environment& sky : {constant_sky({1, 2, 3}), constant_sky({0, 0, 0}), overcast_sky()}) {
    const Environment bright = bright_part(sky);
    EXPECT_EQ(bright.width * bright.height, 1) << sky.name;
    EXPECT_EQ(bright.radiance[0], Vec3f{}) << sky.name;
  }
}

TEST(BrightPart, OfAClearSkyIsItsSun) {
  const Environment sky = clear_sky_with_sun();
  const std::vector<Vec3f> all = project_environment(sky, 1), bright = project_environment(bright_part(sky), 1);
  // core/scene/skies.cpp: 30 W m^-2 of (1.1, .99, .81); of the texels' own sky kBright times the mean stays in the rest
  const double to_flux = 2 * std::sqrt(std::numbers::pi);
  EXPECT_NEAR(bright[0].x * to_flux, 33, 0.1);
  EXPECT_NEAR(bright[0].y * to_flux, 29.7, 0.1);
  EXPECT_NEAR(bright[0].z * to_flux, 24.3, 0.1);
  EXPECT_GT(all[0].x, bright[0].x);
}

TEST(BrightPart, LeavesAtMostSoManyTimesTheMeanOfTheRest) {
  Environment map{.name = "lamps", .width = 64, .height = 32, .radiance = std::vector<Vec3f>(64 * 32, {1, 1, 1})};
  map.radiance[700] = {3e6F, 1e6F, 0};
  map.radiance[1500] = {100, 200, 300};
  const Environment bright = bright_part(map);
  ASSERT_EQ(bright.radiance.size(), map.radiance.size());
  for (std::size_t i = 0; i < map.radiance.size(); ++i) {
    const Vec3f rest = map.radiance[i] - bright.radiance[i];
    // 2 lamps of 2048 texels leave a mean of at most (1 + 2 * 1.6 * kBright * mean / 2048): 1.02
    EXPECT_LE((rest.x + rest.y + rest.z) / 3, 1.03F * static_cast<float>(kBright)) << i;
    if (i != 700 && i != 1500) {
      EXPECT_EQ(bright.radiance[i], Vec3f{});
    }
  }
  EXPECT_NEAR(bright.radiance[1500].z / bright.radiance[1500].x, 3, 1e-5);  // of the texel's colour
}

}  // namespace
}  // namespace kiln
