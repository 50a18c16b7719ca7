#include "core/lightfield/light_field.h"

#include <algorithm>

namespace kiln {

std::vector<double> mean_light(const LightField& field, std::size_t vertex) {
  const std::span<const float> c = field.of(vertex);
  std::vector<double> out(c.begin(), c.end());
  if (!field.has_sky()) return out;
  const std::size_t shared = std::min(field.count(), kVisibilityCount);
  for (std::size_t channel = 0; channel < 3; ++channel)
    for (std::size_t i = 0; i < shared; ++i)
      out[channel * field.count() + i] +=
          double{field.sky[channel]} * double{field.visibility[kVisibilityCount * vertex + i]};
  return out;
}

}  // namespace kiln
