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

#include <png.h>

#include <array>
#include <new>

#include "core/base/expects.h"

namespace kiln {
namespace {

void append_to(png_structp png, png_bytep data, std::size_t size) {
  auto& out = *static_cast<Bytes*>(png_get_io_ptr(png));
  out.insert(out.end(), data, data + size);
}

/// Of 16 bits, through libpng: stb writes eight.
Bytes write_deep_png(const PixelShape& shape, std::span<const std::uint8_t> pixels, std::size_t row) {
  constexpr std::array kTypes = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                 PNG_COLOR_TYPE_RGB_ALPHA};
  const auto fail = [](png_structp, png_const_charp) { throw std::bad_alloc(); };  // nothing else can go wrong here
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, nullptr);
  if (png == nullptr) throw std::bad_alloc();
  png_infop info = png_create_info_struct(png);
  Bytes out;
  png_set_write_fn(png, &out, append_to, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(shape.width), static_cast<png_uint_32>(shape.height), shape.depth,
               kTypes[static_cast<std::size_t>(shape.channels) - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  for (std::size_t y = 0; y < static_cast<std::size_t>(shape.height); ++y) png_write_row(png, pixels.data() + y * row);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

}  // namespace

Bytes write_png(const PixelShape& shape, std::span<const std::uint8_t> pixels) {
  EXPECTS(shape.width > 0 && shape.height > 0 && shape.channels >= 1 && shape.channels <= 4);
  EXPECTS(shape.depth == 8 || shape.depth == 16);
  const auto row = static_cast<std::size_t>(shape.width) * static_cast<std::size_t>(shape.channels * shape.depth / 8);
  EXPECTS(pixels.size() == row * static_cast<std::size_t>(shape.height));
  if (shape.depth == 16) return write_deep_png(shape, pixels, row);
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
