#include "core/prt/row_store.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace kiln {
namespace {

TEST(RowStore, GivesBackWhatItGotWithinItsRounding) {
  constexpr std::size_t kWidth = 39;
  RowStore store(kWidth);
  std::vector<float> rows;
  Random random(1, 2);
  for (std::size_t i = 0; i < 5000 * kWidth; ++i) {  // more rows than a chunk holds, sizes from 1e-20 to 1e20
    const float size = std::pow(10.0F, 40 * random.uniform() - 20);
    rows.push_back(random.uniform() < 0.1F ? 0.0F : size * (2 * random.uniform() - 1));
  }
  store.append(std::span(rows).first(7 * kWidth));
  store.append(std::span(rows).subspan(7 * kWidth));
  ASSERT_EQ(store.size(), 5000U);
  std::vector<float> back(kWidth);
  for (std::size_t r = 0; r < store.size(); ++r) {
    store.load(r, back.data());
    for (std::size_t i = 0; i < kWidth; ++i) {
      float largest = 0;
      for (std::size_t k = i / 4 * 4; k < std::min(kWidth, i / 4 * 4 + 4); ++k)
        largest = std::max(largest, std::abs(rows[r * kWidth + k]));
      EXPECT_LE(std::abs(back[i] - rows[r * kWidth + i]), largest * 0x1p-13F) << "row " << r << " number " << i;
    }
  }
}

TEST(RowStore, ABrightFourLeavesTheOthersAlone) {
  RowStore store(8);
  const std::vector<float> row = {1e6F, 2e6F, 3e6F, 0, 1e-3F, 2e-3F, 0.5e-3F, 0};
  store.append(row);
  std::vector<float> four(4);
  store.load_four(0, 1, four.data());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(four[i], row[4 + i], 2e-3 * 0x1p-13);
}

}  // namespace
}  // namespace kiln
