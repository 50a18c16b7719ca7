#include "core/prt/morton.h"

#include <algorithm>

namespace kiln {
namespace {

std::uint32_t grid_cell(float x, float cells) {
  return static_cast<std::uint32_t>(std::clamp(x * cells, 0.0F, cells - 1));
}

// Puts one (or two) zero bits between the low bits of x.
std::uint32_t spread_by_one(std::uint32_t x) {
  x = (x | x << 8) & 0x00ff00ffU;
  x = (x | x << 4) & 0x0f0f0f0fU;
  x = (x | x << 2) & 0x33333333U;
  return (x | x << 1) & 0x55555555U;
}

std::uint32_t spread_by_two(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ffU;
  x = (x | x << 8) & 0x0300f00fU;
  x = (x | x << 4) & 0x030c30c3U;
  return (x | x << 2) & 0x09249249U;
}

}  // namespace

std::uint32_t morton_code(const Vec2f& p) {
  return spread_by_one(grid_cell(p.x, 65536)) | spread_by_one(grid_cell(p.y, 65536)) << 1;
}

std::uint32_t morton_code(const Vec3f& p) {
  return spread_by_two(grid_cell(p.x + 0.5F, 1024)) | spread_by_two(grid_cell(p.y + 0.5F, 1024)) << 1 |
         spread_by_two(grid_cell(p.z + 0.5F, 1024)) << 2;
}

std::vector<std::uint32_t> morton_order(std::span<const Vec3f> positions) {
  std::vector<std::uint64_t> key(positions.size());  // code above index: distinct, so any sort is stable
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = std::uint64_t{morton_code(positions[i])} << 32 | i;
  std::sort(key.begin(), key.end());
  std::vector<std::uint32_t> order(key.size());
  std::transform(key.begin(), key.end(), order.begin(), [](std::uint64_t k) { return static_cast<std::uint32_t>(k); });
  return order;
}

}  // namespace kiln
