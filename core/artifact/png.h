#pragma once
// PNG files from pixels.

#include <cstdint>
#include <span>

#include "core/artifact/import.h"

namespace kiln {

struct PixelShape {
  int width = 0, height = 0;
  int channels = 3;  // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA
  int depth = 8;     // bits of a value; of 16 the higher byte comes first
};

/// The bytes of a PNG. `pixels` holds height * width * channels values, top row first, as displayed (sRGB).
/// Repeat: same bytes for same pixels.
Bytes write_png(const PixelShape&, std::span<const std::uint8_t> pixels);

/// One white pixel: stands for an image whose bytes were lost.
Bytes white_pixel_png();

}  // namespace kiln
