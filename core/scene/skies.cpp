// Built-in skies by formula: ISO 15469 (CIE S 011) luminance distributions, zenith luminance 1.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/scene/environment.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSkyWidth = 256, kSkyHeight = 128;
constexpr double kGroundReflectance = 0.2;

constexpr double kSunElevation = kPi / 4;
constexpr double kSunAzimuth = kPi / 4;  // between +X and +Z
constexpr double kSunRadius = 0.53 / 2 * kPi / 180;
constexpr double kSunNormalIrradiance = 30;  // about 4 times what the sky sends on a level plane
constexpr Vec3f kSkyTint{0.80F, 0.99F, 1.69F}, kSunTint{1.10F, 0.99F, 0.81F};  // luminance 1 (Rec. 709 weights)

Vec3d direction(double x, double y) {
  const double phi = 2 * kPi * (x / kSkyWidth - 0.5), theta = kPi * y / kSkyHeight;
  return {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
}

template <class Sky>
Environment sky_map(const char* name, const Sky& sky) {
  Environment e{.name = name, .width = kSkyWidth, .height = kSkyHeight, .radiance = {}};
  e.radiance.reserve(static_cast<std::size_t>(kSkyWidth) * kSkyHeight);
  for (int j = 0; j < kSkyHeight; ++j) {
    for (int i = 0; i < kSkyWidth; ++i) e.radiance.push_back(sky(direction(i + 0.5, j + 0.5)));
  }
  return e;
}

/// L / L_zenith = (1 + 2 sin(elevation)) / 3.
double overcast(double sine) { return (1 + 2 * sine) / 3; }

/// CIE clear sky: gradation 1 - exp(-0.32 / cos Z), indicatrix 0.91 + 10 exp(-3 chi) + 0.45 cos^2 chi.
double clear(double sine, double chi) {
  const auto indicatrix = [](double a) { return 0.91 + 10 * std::exp(-3 * a) + 0.45 * std::cos(a) * std::cos(a); };
  const auto gradation = [](double s) { return 1 - std::exp(-0.32 / std::max(s, 1e-6)); };
  return indicatrix(chi) * gradation(sine) / (indicatrix(kPi / 2 - kSunElevation) * gradation(1));
}

Vec3d sun_direction() {
  return {std::cos(kSunElevation) * std::cos(kSunAzimuth), std::sin(kSunElevation),
          std::cos(kSunElevation) * std::sin(kSunAzimuth)};
}

/// Spreads the sun over the texels it covers, by area; the map then carries its irradiance whole.
void add_sun(Environment& e) {
  constexpr int kGrid = 32;  // samples along a texel's side
  const double cosine = std::cos(kSunRadius);
  const Vec3d sun = sun_direction();
  std::vector<double> cover(e.radiance.size());
  double flux = 0;  // of radiance 1, as the bilinear map carries it: a texel counts by its solid angle
  for (int j = 0; j < kSkyHeight; ++j) {
    const double solid_angle =
        2 * kPi / kSkyWidth * (std::cos(kPi * j / kSkyHeight) - std::cos(kPi * (j + 1) / kSkyHeight));
    for (int i = 0; i < kSkyWidth; ++i) {
      if (dot(direction(i + 0.5, j + 0.5), sun) < std::cos(0.05)) continue;
      int inside = 0;
      for (int k = 0; k < kGrid * kGrid; ++k) {
        const int column = k % kGrid, row = k / kGrid;
        const Vec3d w = direction(i + (column + 0.5) / kGrid, j + (row + 0.5) / kGrid);
        inside += dot(w, sun) >= cosine ? 1 : 0;
      }
      const auto at = static_cast<std::size_t>(j * kSkyWidth + i);
      cover[at] = inside;
      flux += solid_angle * inside;
    }
  }
  for (std::size_t i = 0; i < cover.size(); ++i) {
    e.radiance[i] += kSunTint * static_cast<float>(kSunNormalIrradiance * cover[i] / flux);
  }
}

}  // namespace

Environment constant_sky(const Vec3f& radiance) {
  return {.name = "constant", .width = 1, .height = 1, .radiance = {radiance}};
}

Environment overcast_sky() {
  return sky_map("overcast", [](const Vec3d& w) {
    const auto l = static_cast<float>(w.y >= 0 ? overcast(w.y) : kGroundReflectance * overcast(0));
    return Vec3f{l, l, l};
  });
}

Environment clear_sky_with_sun() {
  Environment e = sky_map("clear", [](const Vec3d& w) {
    const double sine = std::max(w.y, 0.0);
    const double chi = std::acos(std::clamp(dot(normalized(Vec3d{w.x, sine, w.z}), sun_direction()), -1.0, 1.0));
    return kSkyTint * static_cast<float>((w.y >= 0 ? 1.0 : kGroundReflectance) * clear(sine, chi));
  });
  add_sun(e);
  return e;
}

}  // namespace kiln
