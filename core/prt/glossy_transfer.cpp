#include "core/prt/glossy_transfer.h"

#include <algorithm>

#include "core/base/expects.h"

namespace kiln {

std::size_t GlossyTransfer::find(std::uint32_t vertex) const {
  const auto found = std::ranges::lower_bound(vertices, vertex);
  if (found == vertices.end() || *found != vertex) return kNoMatrix;
  return static_cast<std::size_t>(found - vertices.begin());
}

LitComponents light_components(const GlossyTransfer& glossy, std::span<const Vec3f> light, bool lamps) {
  const auto outputs = static_cast<std::size_t>(glossy.outputs()), inputs = static_cast<std::size_t>(glossy.inputs());
  EXPECTS(light.empty() || light.size() >= outputs);
  LitComponents out{glossy.outputs(), std::vector<Vec3f>((glossy.rank() + 1) * outputs)};
  for (std::size_t k = 0; k <= glossy.rank(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float* row =
          glossy.components.rows.data() + k * glossy.stride() + (glossy.channels == 1 ? 0 : c) * outputs * inputs;
      for (std::size_t o = 0; o < outputs; ++o, row += inputs) {
        double sum = glossy.fixed && lamps ? double{row[outputs]} : 0;
        for (std::size_t i = 0; i < outputs && i < light.size(); ++i) sum += double{row[i]} * light[i][c];
        out.rgb[k * outputs + o][c] = static_cast<float>(sum);
      }
    }
  }
  return out;
}

void incident_light(const GlossyTransfer& glossy, const LitComponents& lit, std::size_t n, Vec3d* out) {
  EXPECTS(n < glossy.vertices.size());
  const auto outputs = static_cast<std::size_t>(lit.outputs);
  for (std::size_t o = 0; o < outputs; ++o) out[o] = to_double(lit.rgb[o]);
  const float* weight = glossy.weights.data() + n * glossy.rank();
  for (std::size_t k = 0; k < glossy.rank(); ++k) {
    const Vec3f* row = lit.rgb.data() + (k + 1) * outputs;
    for (std::size_t o = 0; o < outputs; ++o) out[o] += to_double(row[o]) * double{weight[k]};
  }
}

}  // namespace kiln
