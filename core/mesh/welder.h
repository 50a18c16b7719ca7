#pragma once
// Names points in space by their exact position, while points are being added.

#include <array>
#include <bit>
#include <cstdint>
#include <deque>

#include "core/base/index_table.h"
#include "core/base/vec.h"

namespace kiln {

/// Remembers who came first to each bit-equal position (-0 counts as +0).   Memory  about 25 bytes a position
class Welder {
 public:
  /// The id that first came with this position: `id` itself if it is new. Cost O(1) expected.
  std::uint32_t weld(const Vec3f& position, std::uint32_t id);
  /// How many different positions came, and the n-th of them.
  std::size_t size() const { return places_.size(); }
  Vec3f position(std::size_t n) const {
    const auto& [x, y, z] = places_[n].bits;
    return {std::bit_cast<float>(x), std::bit_cast<float>(y), std::bit_cast<float>(z)};
  }

 private:
  struct Place {
    std::array<std::uint32_t, 3> bits;
    std::uint32_t id;
  };
  std::deque<Place> places_;
  IndexTable table_;
};

}  // namespace kiln
