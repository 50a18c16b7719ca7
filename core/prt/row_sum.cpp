#include "core/prt/row_sum.h"

#include <bit>
#include <cstring>

#include "core/base/expects.h"

namespace kiln {
namespace {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));
using Short8 = std::int16_t __attribute__((vector_size(16)));

template <class Vector, class T>
inline __attribute__((always_inline)) void load(Vector& to, const T* from) {
  std::memcpy(&to, from, sizeof to);
}

// Columns [first, first + 8 kBlocks) of all rows; the sums stay in registers.
template <int kBlocks>
inline __attribute__((always_inline)) void add_columns(std::span<const std::int16_t* const> rows, int first,
                                                       std::int32_t* sum) {
  Int8 total[kBlocks];
  std::memcpy(total, sum + first, sizeof total);
  for (const std::int16_t* row : rows) {
    for (int b = 0; b < kBlocks; ++b) {
      Short8 piece;
      load(piece, row + first + b * 8);
      total[b] += __builtin_convertvector(piece, Int8);
    }
  }
  std::memcpy(sum + first, total, sizeof total);
}

template <int kBlocks>
inline __attribute__((always_inline)) void add_blocks(const float* rows, std::uint32_t mask, float* sum) {
  Float8 total[kBlocks];
  std::memcpy(total, sum, sizeof total);
  for (; mask != 0; mask &= mask - 1) {
    const float* row = rows + std::countr_zero(mask) * kBlocks * 8;
    for (int b = 0; b < kBlocks; ++b) {
      Float8 piece;
      load(piece, row + b * 8);
      total[b] += piece;
    }
  }
  std::memcpy(sum, total, sizeof total);
}

}  // namespace

__attribute__((target_clones("avx2", "default"))) void add_rows(const float* rows, int width, std::uint32_t mask,
                                                                float* sum) {
  switch (width / 8) {
    case 1:
      return add_blocks<1>(rows, mask, sum);  // orders 1 and 2
    case 2:
      return add_blocks<2>(rows, mask, sum);  // 3 and 4
    case 4:
      return add_blocks<4>(rows, mask, sum);  // 5
    case 5:
      return add_blocks<5>(rows, mask, sum);  // 6
    case 7:
      return add_blocks<7>(rows, mask, sum);  // 7
    case 8:
      return add_blocks<8>(rows, mask, sum);  // 8
    case 11:
      return add_blocks<11>(rows, mask, sum);  // 9
    case 13:
      return add_blocks<13>(rows, mask, sum);  // 10
    default:
      EXPECTS(!"a row width of an SH order");
  }
}

__attribute__((target_clones("avx2", "default"))) void add_short_rows(std::span<const std::int16_t* const> rows,
                                                                      int width, std::int32_t* sum) {
  int first = 0;
  for (; first + 56 <= width; first += 56) add_columns<7>(rows, first, sum);
  for (; first + 24 <= width; first += 24) add_columns<3>(rows, first, sum);
  for (; first < width; first += 8) add_columns<1>(rows, first, sum);
}

__attribute__((target_clones("avx2", "default"))) void add_weighted_row(const std::int16_t* row, const float* weight,
                                                                        int width, float* sum) {
  for (int i = 0; i < width; i += 8) {
    Short8 piece;
    Float8 scale, total;
    load(piece, row + i);
    load(scale, weight + i);
    load(total, sum + i);
    total += scale * __builtin_convertvector(__builtin_convertvector(piece, Int8), Float8);
    std::memcpy(sum + i, &total, sizeof total);
  }
}

void fill_weights(const float* rgb, int channels, int count, float* weight) {
  for (int c = 0; c < channels; ++c) {  // each channel runs over into the next, which comes later
    const float w = rgb[c];
    const Float8 eight = {w, w, w, w, w, w, w, w};
    for (int i = 0; i < count; i += 8) std::memcpy(weight + c * count + i, &eight, sizeof eight);
  }
}

__attribute__((target_clones("avx2", "default"))) void combine16(const float* x, const float* y, const float* z,
                                                                 const std::array<float, 3>& abc, float* out) {
  for (int i = 0; i < 16; i += 8) {
    Float8 a, b, c;
    load(a, x + i);
    load(b, y + i);
    load(c, z + i);
    const Float8 sum = abc[0] * a + abc[1] * b + abc[2] * c;
    std::memcpy(out + i, &sum, sizeof sum);
  }
}

}  // namespace kiln
