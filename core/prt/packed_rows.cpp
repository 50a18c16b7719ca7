#include "core/prt/packed_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxStride = 304;  // three channels of order 10, padded
using Short = std::array<std::int16_t, kMaxStride>;

int padded(int width) { return (width + 7) / 8 * 8; }

}  // namespace

std::size_t PackedRows::row_bytes(int order, int channels) {
  return static_cast<std::size_t>(padded(channels * sh_count(order))) * sizeof(std::int16_t);
}

PackedRows::PackedRows(int order, int channels, void* first, std::size_t pitch)
    : first_(static_cast<std::byte*>(first)), pitch_(pitch), stride_(padded(channels * sh_count(order))) {
  constexpr double kHeadroom = 1.25;
  for (int channel = 0; channel < channels; ++channel) {
    for (int l = 0; l < order; ++l) {
      const double bound = std::sqrt((2 * l + 1) / (4 * std::numbers::pi));
      unit_.insert(unit_.end(), static_cast<std::size_t>(2 * l + 1), static_cast<float>(kHeadroom * bound / 32767));
    }
  }
  for (const float u : unit_) per_unit_.push_back(1 / u);
}

void PackedRows::store(std::size_t r, const float* values) {
  Short packed{};
  for (std::size_t i = 0; i < unit_.size(); ++i) {
    const float scaled = std::clamp(values[i] * per_unit_[i], -32767.0F, 32767.0F);
    packed[i] = static_cast<std::int16_t>(scaled + std::copysign(0.5F, scaled));
  }
  std::memcpy(first_ + r * pitch_, packed.data(), static_cast<std::size_t>(stride_) * sizeof(std::int16_t));
}

void PackedRows::load(std::size_t r, float* values) const {
  Short packed;
  std::memcpy(packed.data(), first_ + r * pitch_, static_cast<std::size_t>(stride_) * sizeof(std::int16_t));
  for (std::size_t i = 0; i < unit_.size(); ++i) values[i] = unit_[i] * static_cast<float>(packed[i]);
}

}  // namespace kiln
