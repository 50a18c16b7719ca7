#pragma once
// Adds table rows: the inner loops of projection and of gathering.
// Repeat  the same bits on any machine: no fused operations, one order

#include <array>
#include <cstdint>
#include <span>

namespace kiln {

/// sum[0 .. width) += rows[r * width ...] for every bit r of `mask`. width is a multiple of 8, at most 104.
void add_rows(const float* rows, int width, std::uint32_t mask, float* sum);

/// sum[0 .. width) += each row. width is a multiple of 8. Exact while a sum stays below 2^31: 65536 rows.
void add_short_rows(std::span<const std::int16_t* const> rows, int width, std::int32_t* sum);

/// weight[c * count + i] = rgb[c] for i < count, c < channels. Writes up to 7 numbers beyond.
void fill_weights(const float* rgb, int channels, int count, float* weight);

/// sum[i] += weight[i] * row[i]. width is a multiple of 8.
void add_weighted_row(const std::int16_t* row, const float* weight, int width, float* sum);

/// out[i] = a * x[i] + b * y[i] + c * z[i] for sixteen i.
void combine16(const float* x, const float* y, const float* z, const std::array<float, 3>& abc, float* out);

}  // namespace kiln
