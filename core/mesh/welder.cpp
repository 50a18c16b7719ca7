#include "core/mesh/welder.h"

#include <bit>

#include "core/base/random.h"

namespace kiln {

std::size_t Welder::Hash::operator()(const Key& key) const {
  return mix64(mix64(key[0]) ^ (std::uint64_t{key[1]} << 32 | key[2]));
}

std::uint32_t Welder::weld(const Vec3f& position, std::uint32_t id) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x == 0.0F ? 0.0F : x); };
  return first_.try_emplace(Key{bits(position.x), bits(position.y), bits(position.z)}, id).first->second;
}

}  // namespace kiln
