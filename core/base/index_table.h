#pragma once
// A hash table of indices into records that live elsewhere: 4 bytes a slot, at most two thirds of them in use.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

class IndexTable {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  /// The index for which `same` holds among those of this hash, or kNone.
  template <class Same>
  std::uint32_t find(std::uint64_t hash, const Same& same) const {
    if (slots_.empty()) return kNone;
    for (std::size_t at = hash & mask();; at = (at + 1) & mask()) {
      if (slots_[at] == kNone || same(slots_[at])) return slots_[at];
    }
  }

  /// Adds an index that find does not know. `hash_of(i)` is the hash of any index added so far.
  template <class HashOf>
  void add(std::uint32_t index, const HashOf& hash_of) {
    if (3 * (used_ + 1) > 2 * slots_.size()) grow(hash_of);
    place(index, hash_of(index));
    ++used_;
  }

 private:
  std::size_t mask() const { return slots_.size() - 1; }

  void place(std::uint32_t index, std::uint64_t hash) {
    std::size_t at = hash & mask();
    while (slots_[at] != kNone) at = (at + 1) & mask();
    slots_[at] = index;
  }

  template <class HashOf>
  void grow(const HashOf& hash_of) {
    std::vector<std::uint32_t> old(slots_.empty() ? 16 : 2 * slots_.size(), kNone);
    old.swap(slots_);
    for (const std::uint32_t index : old) {
      if (index != kNone) place(index, hash_of(index));
    }
  }

  std::vector<std::uint32_t> slots_;  // a power of two
  std::size_t used_ = 0;
};

}  // namespace kiln
