#include "core/mesh/welder.h"

#include <bit>

#include "core/base/random.h"

namespace kiln {

std::uint32_t Welder::weld(const Vec3f& position, std::uint32_t id) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x == 0.0F ? 0.0F : x); };
  const auto hash = [](const std::array<std::uint32_t, 3>& b) {
    return mix64(mix64(b[0]) ^ (std::uint64_t{b[1]} << 32 | b[2]));
  };
  const std::array<std::uint32_t, 3> key{bits(position.x), bits(position.y), bits(position.z)};
  const std::uint32_t known = table_.find(hash(key), [&](std::uint32_t i) { return places_[i].bits == key; });
  if (known != IndexTable::kNone) return places_[known].id;
  places_.push_back({key, id});
  table_.add(static_cast<std::uint32_t>(places_.size() - 1), [&](std::uint32_t i) { return hash(places_[i].bits); });
  return id;
}

}  // namespace kiln
