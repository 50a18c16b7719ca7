#pragma once
// KILN_meshless_light, version 2: the light of a radiosity bake as points, levels and coefficients. README.md specifies
// every byte. (Version 1 holds links: links_glb.h.)

#include <cstdint>
#include <span>

#include "core/artifact/import.h"
#include "core/base/result.h"
#include "core/meshless/point_field.h"

namespace kiln {

inline constexpr int kPointsVersion = 2;

/// The file with the extension added. `glb` was written by write_baked_glb.
Result<Bytes> add_points(std::span<const std::uint8_t> glb, const PointField&);

/// Empty where the file has none, or links. Validates every count and number.
/// Fails with unsupported_version, slot_count_mismatch, index_out_of_range, number_out_of_range, json_type, or as
/// read_baked_glb does on a damaged file.
Result<PointField> read_points(std::span<const std::uint8_t> glb);

}  // namespace kiln
