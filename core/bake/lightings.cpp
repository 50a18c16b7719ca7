#include "core/bake/lightings.h"

#include <algorithm>
#include <cmath>

#include "core/scene/environment.h"

namespace kiln {
namespace {

Environment lobe(const Vec3f& axis) {
  Environment map;
  map.width = 64;
  map.height = 32;
  map.radiance.clear();
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const double azimuth = ((x + 0.5) / map.width - 0.5) * 2 * M_PI,
                   elevation = (0.5 - (y + 0.5) / map.height) * M_PI;
      const Vec3d w{std::cos(elevation) * std::cos(azimuth), std::sin(elevation),
                    std::cos(elevation) * std::sin(azimuth)};
      const auto value = static_cast<float>(std::pow(std::max(0.0, dot(w, to_double(axis))), 4));
      map.radiance.push_back({value, value, value});
    }
  }
  return map;
}

}  // namespace

Lightings test_lightings(int order, const BakedLight& light) {
  Lightings out;
  out.names = {"constant", "+x", "-x", "+y", "-y", "+z", "-z"};
  out.sh.push_back(project_environment(constant_sky({1, 1, 1}), order));
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0F, -1.0F}) {
      Vec3f direction;
      direction[static_cast<std::size_t>(axis)] = sign;
      out.sh.push_back(project_environment(lobe(direction), order));
    }
  }
  if (!light.coefficients.empty()) {
    out.names.push_back(light.name);
    out.sh.push_back(light.coefficients);
  }
  return out;
}

std::vector<double> band_power(int order, const BakedLight& light) {
  std::vector<double> out(static_cast<std::size_t>(order), 4 * M_PI);  // the sun: 4 pi Y(w), of mean square 4 pi
  double count = 1;
  for (const auto& sh : test_lightings(order, light).sh) {
    double mean = 0;
    for (std::size_t c = 0; c < 3; ++c) mean += sh[0][c] / 3 / (2 * std::sqrt(M_PI));
    if (!(mean > 0)) continue;
    for (int l = 0; l < order; ++l) {
      double power = 0;
      for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
        for (std::size_t c = 0; c < 3; ++c) power += std::pow(sh[static_cast<std::size_t>(i)][c] / mean, 2) / 3;
      }
      out[static_cast<std::size_t>(l)] += power / (2 * l + 1);
    }
    count += 1;
  }
  for (double& power : out) power /= count;
  return out;
}

}  // namespace kiln
