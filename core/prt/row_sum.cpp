#include "core/prt/row_sum.h"

#include <bit>
#include <cstring>

#include "core/base/expects.h"

namespace kiln {
namespace {

using Float8 = float __attribute__((vector_size(32)));

template <int kBlocks>
inline __attribute__((always_inline)) void add_blocks(const float* rows, std::uint32_t mask, float* sum) {
  Float8 total[kBlocks];
  std::memcpy(total, sum, sizeof total);
  for (; mask != 0; mask &= mask - 1) {
    const float* row = rows + std::countr_zero(mask) * kBlocks * 8;
    for (int b = 0; b < kBlocks; ++b) {
      Float8 piece;
      std::memcpy(&piece, row + b * 8, sizeof piece);
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

}  // namespace kiln
