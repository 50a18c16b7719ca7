#pragma once
// PNG through libpng.

#include "core/artifact/image_decode.h"

namespace kiln {

/// Fills `rgba` (width * height * 4) with the samples as stored: gamma and colour profiles are ignored, as glTF asks.
/// Row by row, so data that inflates to more than the header says is never held. False if the file is corrupt.
bool decode_png(std::span<const std::uint8_t> file, const ImageHeader&, std::span<std::uint8_t> rgba);

}  // namespace kiln
