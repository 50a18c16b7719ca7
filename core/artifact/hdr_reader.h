#pragma once
// Radiance .hdr pictures.

#include "core/artifact/import.h"

namespace kiln {

inline constexpr int kMaxEnvironmentWidth = 8192, kMaxEnvironmentHeight = 4096;

bool looks_like_hdr(std::span<const std::uint8_t> file);

/// 32-bit_rle_rgbe with flat, old and new run lengths, orientation -Y h +X w.
/// value = mantissa / 256 * 2^(exponent - 128), without the half that some readers add (it is what OpenImageIO does).
/// EXPOSURE lines divide, as the format says. Fails with hdr_invalid, hdr_truncated, image_too_large.
Result<Environment> read_hdr(std::span<const std::uint8_t> file, const std::string& name);

}  // namespace kiln
