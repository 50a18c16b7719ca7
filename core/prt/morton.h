#pragma once
// Orders in which neighbours in space are neighbours in work: caches and packets like them.

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

/// Interleaved bits of a point of the unit square (16 each) or of the unit cube about the origin (10 each).
std::uint32_t morton_code(const Vec2f& unit_square);
std::uint32_t morton_code(const Vec3f& unit_cube);

/// Indices of `positions` along the Morton curve; equal codes keep their order.
std::vector<std::uint32_t> morton_order(std::span<const Vec3f> positions);

}  // namespace kiln
