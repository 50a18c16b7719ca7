#include "core/artifact/png.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb_image_write.h>
#pragma GCC diagnostic pop

#include "core/base/expects.h"

namespace kiln {

Bytes write_png(const PixelShape& shape, std::span<const std::uint8_t> pixels) {
  EXPECTS(shape.width > 0 && shape.height > 0 && shape.channels >= 1 && shape.channels <= 4);
  const auto row = static_cast<std::size_t>(shape.width) * static_cast<std::size_t>(shape.channels);
  EXPECTS(pixels.size() == row * static_cast<std::size_t>(shape.height));
  Bytes out;
  const auto append = [](void* context, void* data, int size) {
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    static_cast<Bytes*>(context)->insert(static_cast<Bytes*>(context)->end(), bytes, bytes + size);
  };
  const int written = stbi_write_png_to_func(append, &out, shape.width, shape.height, shape.channels, pixels.data(),
                                             static_cast<int>(row));
  EXPECTS(written != 0);
  return out;
}

Bytes white_pixel_png() { return write_png({1, 1, 3}, Bytes{255, 255, 255}); }

}  // namespace kiln
