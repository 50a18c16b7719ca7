#pragma once
// Rows of numbers in 16 bits each, for points that may become vertices. Rows are appended and never move.
//
// Four neighbouring numbers are one word: an exponent and four mantissas of 14 bits (block floating point), so numbers
// of very different size do not spoil each other as long as they lie in different fours. A four of all rows lies
// together: what works column by column can give back the memory of those it is done with.
// Error   2^-13 of the largest of the four: a fiftieth of the noise of 4096 rays
// Memory  2 bytes a number: 72 a row at order 6

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace kiln {

class RowStore {
 public:
  static constexpr std::size_t kFour = 4;

  explicit RowStore(std::size_t width);
  std::size_t width() const { return width_; }
  std::size_t fours() const { return columns_.size(); }  // of a row; the last may be partly padding
  std::size_t size() const { return size_; }

  /// Any number of whole rows, finite.
  void append(std::span<const float> rows);
  void load(std::size_t row, float* values) const;
  /// Numbers 4 `four` .. 4 `four` + 3 of a row, zero past its width.
  void load_four(std::size_t row, std::size_t four, float* values) const;
  /// Forgets a four of every row.
  void release(std::size_t four) { columns_[four].clear(); }

 private:
  static constexpr std::size_t kChunk = 4096;  // rows
  using Column = std::vector<std::unique_ptr<std::uint64_t[]>>;

  std::size_t width_, size_ = 0;
  std::vector<Column> columns_;
};

}  // namespace kiln
