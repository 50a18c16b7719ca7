#pragma once
// Transfer vectors in 16 bits a number: what the passes of interreflection read at random.
//
// Fixed point over a proven range: t_i = integral of K(w) Y_i(w) dw with K >= 0 and integral K <= 1 (a scene reflects
// no more than it gets), so |t_i| <= max |Y_i| <= sqrt((2l + 1) / 4 pi), by the addition theorem. A quarter is left
// for noise; beyond it numbers are clamped.
// Error   rounding, at most 0.625 sqrt((2l + 1) / 4 pi) / 32767: 5e-6 in band 0, 2e-5 in band 5
// Shape   a row has channels x order^2 numbers, channel by channel, zero padded to a multiple of 8

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace kiln {

/// Rows laid into memory that the caller owns, `pitch` bytes apart.
class PackedRows {
 public:
  PackedRows(int order, int channels, void* first, std::size_t pitch);
  /// Bytes that one row takes.
  static std::size_t row_bytes(int order, int channels);

  int width() const { return static_cast<int>(unit_.size()); }  // numbers of a row
  int stride() const { return stride_; }                        // with the padding
  /// What one unit of number i is worth.
  float unit(int i) const { return unit_[static_cast<std::size_t>(i)]; }

  const std::int16_t* row(std::size_t r) const { return reinterpret_cast<const std::int16_t*>(first_ + r * pitch_); }
  /// A row as it lies there, padding included.
  std::span<std::int16_t> numbers(std::size_t r) {
    return {reinterpret_cast<std::int16_t*>(first_ + r * pitch_), static_cast<std::size_t>(stride_)};
  }
  void store(std::size_t r, const float* values);
  void load(std::size_t r, float* values) const;

 private:
  std::byte* first_;
  std::size_t pitch_;
  int stride_;
  std::vector<float> unit_, per_unit_;
};

}  // namespace kiln
