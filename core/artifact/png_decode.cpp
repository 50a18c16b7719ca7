#include "core/artifact/png_decode.h"

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>

namespace kiln {
namespace {

/// Reads from memory; an error past the end.
void read_bytes(png_structp png, png_bytep out, std::size_t n) {
  auto& left = *static_cast<std::span<const std::uint8_t>*>(png_get_io_ptr(png));
  if (n > left.size()) png_error(png, "end");
  std::memcpy(out, left.data(), n);
  left = left.subspan(n);
}

[[noreturn]] void leave(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void ignore(png_structp, png_const_charp) {}

/// Any colour type and depth to 8-bit RGBA; 16 bits are rounded. gAMA, cHRM, sRGB and profiles are not looked at, as
/// glTF demands.
void ask_for_rgba(png_structp png) {
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_gray_to_rgb(png);
  png_set_add_alpha(png, 0xFF, PNG_FILLER_AFTER);
}

/// No object with a destructor lives here: errors come back by longjmp.
bool read_rows(png_structp png, png_infop info, const ImageHeader& header, std::uint8_t* rgba) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_user_limits(png, kMaxImageSide, kMaxImageSide);
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, 0);
  png_read_info(png, info);
  if (png_get_image_width(png, info) != header.width || png_get_image_height(png, info) != header.height) return false;
  ask_for_rgba(png);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != header.width * 4) return false;
  for (int pass = 0; pass < passes; ++pass) {
    for (std::uint64_t y = 0; y < header.height; ++y) png_read_row(png, rgba + y * header.width * 4, nullptr);
  }
  return true;
}

}  // namespace

bool decode_png(std::span<const std::uint8_t> file, const ImageHeader& header, std::span<std::uint8_t> rgba) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, ignore);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  bool good = false;
  if (info) {
    png_set_read_fn(png, &file, read_bytes);
    good = read_rows(png, info, header, rgba.data());
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return good;
}

}  // namespace kiln
