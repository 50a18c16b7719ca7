#pragma once
// Adds table rows: the inner loop of projection.

#include <cstdint>

namespace kiln {

/// sum[0 .. width) += rows[r * width ...] for every bit r of `mask`. width is a multiple of 8, at most 104.
/// The same bits on any machine: no fused operations, one order.
void add_rows(const float* rows, int width, std::uint32_t mask, float* sum);

}  // namespace kiln
