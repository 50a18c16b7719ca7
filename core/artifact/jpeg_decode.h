#pragma once
// JPEG through libjpeg-turbo.

#include "core/artifact/image_decode.h"

namespace kiln {

/// Fills `rgba` (width * height * 4), alpha 255. False if the file is corrupt, cut off, of four channels,
/// or has more than 64 scans: each costs a pass over the picture, and encoders write about ten.
bool decode_jpeg(std::span<const std::uint8_t> file, const ImageHeader&, std::span<std::uint8_t> rgba);

}  // namespace kiln
