#pragma once
// Names points in space by their exact position, while points are being added.

#include <array>
#include <cstdint>
#include <unordered_map>

#include "core/base/vec.h"

namespace kiln {

/// Remembers who came first to each bit-equal position (-0 counts as +0).
class Welder {
 public:
  void reserve(std::size_t points) { first_.reserve(points); }
  /// The id that first came with this position: `id` itself if it is new. Cost O(1) expected.
  std::uint32_t weld(const Vec3f& position, std::uint32_t id);

 private:
  using Key = std::array<std::uint32_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const;
  };
  std::unordered_map<Key, std::uint32_t, Hash> first_;
};

}  // namespace kiln
