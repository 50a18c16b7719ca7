#pragma once
// OpenEXR pictures, scanline RGB only.

#include "core/artifact/import.h"

namespace kiln {

bool looks_like_exr(std::span<const std::uint8_t> file);

/// Reads R, G and B (half or float) of the data window. Deep, multi-part and tiled files are refused by their version
/// flags before OpenEXR sees them. Fails with exr_unsupported, exr_invalid, image_too_large.
Result<Environment> read_exr(std::span<const std::uint8_t> file, const std::string& name);

}  // namespace kiln
