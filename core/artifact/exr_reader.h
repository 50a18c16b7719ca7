#pragma once
// OpenEXR pictures, scanlines of RGB or grey.

#include "core/artifact/import.h"

namespace kiln {

bool looks_like_exr(std::span<const std::uint8_t> file);

/// Reads R, G and B, or Y alone, half or float, of any compression. The picture is the display window: what the data
/// window has of it, and black. Alpha, primaries and the axes of LATLONG are not looked at; a cube is refused. Deep,
/// multi-part and tiled files are refused by their version flags before OpenEXR sees them. Fails with exr_unsupported,
/// exr_invalid, image_too_large.
Result<Environment> read_exr(std::span<const std::uint8_t> file, const std::string& name);

}  // namespace kiln
