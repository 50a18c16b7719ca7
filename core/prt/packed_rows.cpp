#include "core/prt/packed_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/sphere/sh.h"

namespace kiln {

PackedRows::PackedRows(std::size_t rows, int order, int channels)
    : width_(channels * sh_count(order)), stride_((width_ + 7) / 8 * 8) {
  constexpr double kHeadroom = 1.25;
  for (int channel = 0; channel < channels; ++channel) {
    for (int l = 0; l < order; ++l) {
      const double bound = std::sqrt((2 * l + 1) / (4 * std::numbers::pi));
      unit_.insert(unit_.end(), static_cast<std::size_t>(2 * l + 1), static_cast<float>(kHeadroom * bound / 32767));
    }
  }
  for (std::size_t left = rows; left > 0;) {
    const std::size_t in_block = std::min<std::size_t>(left, kBlockMask + 1);
    blocks_.push_back(std::make_unique<std::int16_t[]>(in_block * static_cast<std::size_t>(stride_)));
    left -= in_block;
  }
}

void PackedRows::store(std::size_t r, const float* values) {
  auto* to = const_cast<std::int16_t*>(row(r));
  for (std::size_t i = 0; i < unit_.size(); ++i) {
    to[i] = static_cast<std::int16_t>(std::lrint(std::clamp(values[i] / unit_[i], -32767.0F, 32767.0F)));
  }
}

void PackedRows::load(std::size_t r, float* values) const {
  const std::int16_t* from = row(r);
  for (std::size_t i = 0; i < unit_.size(); ++i) values[i] = unit_[i] * static_cast<float>(from[i]);
}

void PackedRows::release_before(std::size_t r) {
  const std::size_t end = std::min(blocks_.size(), r >> kBlockBits);
  for (; released_ < end; ++released_) blocks_[released_].reset();
}

}  // namespace kiln
