#include "core/lightfield/light_field.h"

#include <algorithm>

namespace kiln {

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
  return out;
}

}  // namespace kiln
