#include "core/artifact/prt_slots.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/expects.h"

namespace kiln {

SlotRanges slot_ranges(const Transfer& transfer, std::span<const std::uint32_t> vertices) {
  EXPECTS(!vertices.empty());
  const std::size_t slots = transfer.stride();
  std::vector<double> low(slots, std::numeric_limits<double>::infinity());
  std::vector<double> high(slots, -std::numeric_limits<double>::infinity());
  for (const auto v : vertices) {
    const float* t = transfer.at(v, 0);
    for (std::size_t s = 0; s < slots; ++s) {
      EXPECTS(std::isfinite(t[s]));
      low[s] = std::min<double>(low[s], t[s]);
      high[s] = std::max<double>(high[s], t[s]);
    }
  }
  SlotRanges out{std::vector<double>(slots), std::vector<double>(slots)};
  for (std::size_t s = 0; s < slots; ++s) {
    out.scale[s] = (high[s] - low[s]) / 2;
    out.offset[s] = low[s] + out.scale[s];
  }
  return out;
}

std::vector<float> pack_slots(const Transfer& transfer, const SlotRanges& ranges, std::size_t k,
                              std::span<const std::uint32_t> vertices) {
  std::vector<float> out(vertices.size() * 4, 0.0F);
  const std::size_t end = std::min(4 * k + 4, transfer.stride());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const float* t = transfer.at(vertices[i], 0);
    for (std::size_t s = 4 * k; s < end; ++s) {
      if (ranges.scale[s] == 0) continue;
      const double stored = (t[s] - ranges.offset[s]) / ranges.scale[s];
      out[i * 4 + s - 4 * k] = static_cast<float>(std::clamp(stored, -1.0, 1.0));
    }
  }
  return out;
}

void unpack_slots(Transfer& transfer, const SlotRanges& ranges, std::size_t k, std::size_t first,
                  std::span<const float> stored) {
  const std::size_t stride = transfer.stride();
  const std::size_t end = std::min(4 * k + 4, stride);
  for (std::size_t i = 0; i < stored.size() / 4; ++i) {
    for (std::size_t s = 4 * k; s < end; ++s) {
      const double value = ranges.offset[s] + ranges.scale[s] * static_cast<double>(stored[i * 4 + s - 4 * k]);
      transfer.coefficients[(first + i) * stride + s] = static_cast<float>(value);
    }
  }
}

}  // namespace kiln
