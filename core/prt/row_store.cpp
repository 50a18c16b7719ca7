#include "core/prt/row_store.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr int kBits = 14, kDigits = kBits - 1;  // of a mantissa, one for the sign
constexpr int kLargest = (1 << kDigits) - 1;
constexpr int kSmallestExponent = -100;  // what is smaller is 0

/// The least e with |x| < 2^e for all four.
int common_exponent(const float* x) {
  float largest = 0;
  for (std::size_t i = 0; i < RowStore::kFour; ++i) largest = std::max(largest, std::abs(x[i]));
  int exponent = kSmallestExponent;
  if (largest > 0) std::frexp(largest, &exponent);
  return std::clamp(exponent, kSmallestExponent, 127);
}

std::uint64_t pack(const float* x) {
  const int exponent = common_exponent(x);
  auto word = static_cast<std::uint8_t>(exponent) + std::uint64_t{0};
  for (std::size_t i = 0; i < RowStore::kFour; ++i) {
    const long mantissa = std::lrint(std::ldexp(x[i], kDigits - exponent));
    const long kept = std::clamp(mantissa, -long{kLargest}, long{kLargest});
    word = word << kBits | (static_cast<std::uint64_t>(kept) & ((1U << kBits) - 1));
  }
  return word;
}

void unpack(std::uint64_t word, float* x) {
  const float unit = std::ldexp(1.0F, static_cast<std::int8_t>(word >> (4 * kBits)) - kDigits);
  for (std::size_t i = RowStore::kFour; i-- > 0; word >>= kBits) {
    const auto shifted = static_cast<std::int32_t>(static_cast<std::uint32_t>(word) << (32 - kBits));
    x[i] = unit * static_cast<float>(shifted >> (32 - kBits));  // with its sign
  }
}

}  // namespace

RowStore::RowStore(std::size_t width) : width_(width), columns_((width + kFour - 1) / kFour) {}

void RowStore::append(std::span<const float> rows) {
  EXPECTS(rows.size() % width_ == 0);
  for (std::size_t first = 0; first < rows.size(); first += width_, ++size_) {
    for (std::size_t four = 0; four < columns_.size(); ++four) {
      Column& column = columns_[four];
      if (size_ % kChunk == 0) column.push_back(std::make_unique<std::uint64_t[]>(kChunk));
      float x[kFour] = {};
      std::copy_n(rows.data() + first + four * kFour, std::min(kFour, width_ - four * kFour), x);
      column.back()[size_ % kChunk] = pack(x);
    }
  }
}

void RowStore::load_four(std::size_t row, std::size_t four, float* values) const {
  unpack(columns_[four][row / kChunk][row % kChunk], values);
}

void RowStore::load(std::size_t row, float* values) const {
  for (std::size_t four = 0; four < columns_.size(); ++four) {
    float x[kFour];
    load_four(row, four, x);
    std::copy_n(x, std::min(kFour, width_ - four * kFour), values + four * kFour);
  }
}

}  // namespace kiln
