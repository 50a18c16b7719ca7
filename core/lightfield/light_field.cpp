#include "core/lightfield/light_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln {

LightField empty_like(const LightField& field) {
  LightField out;
  out.degree = field.degree, out.channels = field.channels, out.noise = field.noise;
  out.sky = field.sky, out.sky_slope = field.sky_slope, out.lamps = field.lamps;
  out.emission_apart = field.emission_apart, out.diffuse_color = field.diffuse_color;
  return out;
}

std::vector<double> mean_light(const LightField& field, std::size_t vertex) {
  const std::span<const float> c = field.of(vertex);
  std::vector<double> out(c.begin(), c.end());
  const auto add = [&](const Vec3f& mean, const float* series, double share) {
    const std::size_t shared = std::min(field.count(), kVisibilityCount);
    for (std::size_t channel = 0; channel < 3; ++channel)
      for (std::size_t i = 0; i < shared; ++i)
        out[channel * field.count() + i] += share * double{mean[channel]} * double{series[i]};
  };
  if (field.has_sky()) add(field.sky, &field.visibility[kVisibilityCount * vertex], 1);
  for (std::size_t k = 0; k < field.lamps.size(); ++k)
    add(field.lamps[k].mean, field.lamps[k].lobe.data(),
        double{field.lamp_visibility[field.lamps.size() * vertex + k]});
  for (std::size_t channel = 0; field.has_diffuse() && channel < 3; ++channel)
    out[channel * field.count()] += 2 * std::sqrt(std::numbers::pi) * double{field.diffuse_color[channel]} *
                                    double{field.diffuse[3 * vertex + channel]};
  return out;
}

}  // namespace kiln
