#pragma once
// Transfer coefficients as the VEC4s of a file: each slot normalised over its own range.
//   value = offset[s] + scale[s] * stored,  stored in [-1, 1],  s = channel * slots + i                  (1)
// Error   after b-bit quantisation at most scale[s] / (2^b - 1) = range / (2^b - 1) / 2, and float rounding
// A constant slot has scale 0 and is exact. Components past the last slot carry nothing.

#include <cstdint>
#include <span>
#include <vector>

#include "core/prt/transfer.h"

namespace kiln {

struct SlotRanges {
  std::vector<double> scale, offset;  // per flat slot
};

/// Half range and middle of every slot over the given vertices.
SlotRanges slot_ranges(const Transfer&, std::span<const std::uint32_t> vertices);

/// How many VEC4 attributes hold the flat slots.
inline std::size_t slot_vec4s(std::size_t slots) { return (slots + 3) / 4; }

/// The normalised values of flat slots 4k..4k+3 for the given vertices.
std::vector<float> pack_slots(const Transfer&, const SlotRanges&, std::size_t k,
                              std::span<const std::uint32_t> vertices);

/// Equation 1: writes flat slots 4k..4k+3 of vertices first, first + 1, ... from stored VEC4s.
void unpack_slots(Transfer&, const SlotRanges&, std::size_t k, std::size_t first, std::span<const float> stored);

}  // namespace kiln
