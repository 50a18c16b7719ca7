#include "core/lightfield/field_lamp.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/trace/ggx.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSeenAlpha = 0.15, kTurn = 0.1;  // of the blur that distances see, and of normals (README.md)
constexpr int kSteps = 1024;

/// What an eye on the normal is sent by light of 1 from an angle beside it, at F0 = 1.
double blurred(double angle) { return ggx_cosine(kSeenAlpha, {0, 0, 1}, {std::sin(angle), 0, std::cos(angle)}); }

/// Mean over the sphere of a function of the angle.
template <class Function>
double mean_over_angles(const Function& f) {
  double sum = 0, all = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = kPi * (i + 0.5) / kSteps;
    sum += std::sin(angle) * f(angle), all += std::sin(angle);
  }
  return sum / all;
}

/// Of a band, and the Legendre polynomial of it.
double legendre(int band, double z) { return band == 0 ? 1 : band == 1 ? z : 1.5 * z * z - 0.5; }

}  // namespace

FieldLamp make_field_lamp(const Light& light, const Vec3f& mean) {
  FieldLamp out{.light = light, .mean = mean};
  const bool distant = light.type == LightType::directional;
  const Vec3d way = distant ? -to_double(light.direction) : to_double(light.position);
  std::array<double, kVisibilityCount> y{};
  evaluate_sh(kVisibilityOrder, normalized(way, Vec3d{0, 1, 0}), y.data());
  double squares = 0;
  for (int band = 0, i = 0; band < kVisibilityOrder; ++band) {
    const double c =
        4 * kPi * mean_over_angles([&](double a) { return blurred(a) * legendre(band, std::cos(a)); });  // Funk-Hecke
    for (const int end = sh_count(band + 1); i < end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      out.lobe[k] = static_cast<float>(c * y[k]);
      squares += double{out.lobe[k]} * double{out.lobe[k]};
    }
  }
  // Few bands stand for the whole lobe, as large as it is.
  const double whole = 4 * kPi * mean_over_angles([](double a) { return blurred(a) * blurred(a); });
  for (float& c : out.lobe) c *= static_cast<float>(std::sqrt(whole / squares));
  return out;
}

double lamp_slope(std::span<const FieldLamp> lamps) {
  double all = 0;
  for (const FieldLamp& lamp : lamps) all += double{dot(lamp.mean, lamp.mean)};
  if (!(all > 0)) return 0;
  const double slope = mean_over_angles([](double a) {
    const double off = blurred(std::min(kPi, a + kTurn)) - blurred(a);
    return off * off / (kTurn * kTurn);
  });
  // As with the sky (outgoing.cpp): the mirror direction turns by 8/3 in the mean square over eyes.
  return 8.0 / 3 * slope * all;
}

}  // namespace kiln
