#pragma once
// Transfer vectors in 16 bits a number: what the passes of interreflection read at random.
//
// Fixed point over a proven range: t_i = integral of K(w) Y_i(w) dw with K >= 0 and integral K <= 1 (a scene reflects
// no more than it gets), so |t_i| <= max |Y_i| <= sqrt((2l + 1) / 4 pi), by the addition theorem. A quarter is left
// for noise; beyond it numbers are clamped.
// Error   rounding, at most 0.625 sqrt((2l + 1) / 4 pi) / 32767: 5e-6 in band 0, 2e-5 in band 5
// Shape   a row has channels x order^2 numbers, channel by channel, zero padded to a multiple of 8
// Memory  blocks of 4096 rows, each freed alone

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace kiln {

class PackedRows {
 public:
  PackedRows(std::size_t rows, int order, int channels);

  int width() const { return width_; }    // numbers of a row
  int stride() const { return stride_; }  // with the padding
  /// What one unit of number i is worth.
  float unit(int i) const { return unit_[static_cast<std::size_t>(i)]; }

  const std::int16_t* row(std::size_t r) const {
    return blocks_[r >> kBlockBits].get() + (r & kBlockMask) * static_cast<std::size_t>(stride_);
  }
  void store(std::size_t r, const float* values);
  void load(std::size_t r, float* values) const;

  /// Frees all rows of whole blocks before row r.
  void release_before(std::size_t r);

 private:
  static constexpr std::size_t kBlockBits = 12, kBlockMask = (1U << kBlockBits) - 1;
  int width_, stride_;
  std::size_t released_ = 0;
  std::vector<float> unit_;
  std::vector<std::unique_ptr<std::int16_t[]>> blocks_;
};

}  // namespace kiln
