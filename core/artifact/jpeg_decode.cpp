#include "core/artifact/jpeg_decode.h"

#include <algorithm>
#include <csetjmp>
#include <cstdio>

// libjpeg's header needs FILE and size_t before it.
#include <jerror.h>
#include <jpeglib.h>

namespace kiln {
namespace {

struct Errors {
  jpeg_error_mgr manager;  // first, so that libjpeg's pointer to it is one to us
  std::jmp_buf leave;
  bool cut_off = false;
};

[[noreturn]] void leave(j_common_ptr info) { std::longjmp(reinterpret_cast<Errors*>(info->err)->leave, 1); }

/// Warnings are ignored, but for data that ends early.
void note(j_common_ptr info, int level) {
  auto* errors = reinterpret_cast<Errors*>(info->err);
  if (level < 0 && info->err->msg_code == JWRN_JPEG_EOF) errors->cut_off = true;
}

void stay_silent(j_common_ptr) {}

/// Entropy-coded data never holds 0xFF 0xDA: there 0xFF is followed by 0 or a restart marker.
bool has_few_scans(std::span<const std::uint8_t> file) {
  constexpr int kMaxScans = 64;
  int scans = 0;
  for (std::size_t i = 0; i + 1 < file.size(); ++i) scans += file[i] == 0xFF && file[i + 1] == 0xDA ? 1 : 0;
  return scans <= kMaxScans;
}

/// CMYK without profiles to RGB, in place. Writers that leave Adobe's marker store ink upside down: 255 is none.
void rgba_from_cmyk(std::uint8_t* pixels, std::uint64_t count, bool upside_down) {
  for (std::uint8_t* p = pixels; p != pixels + 4 * count; p += 4) {
    const auto left = [&](int c) { return static_cast<unsigned>(upside_down ? p[c] : 255 - p[c]); };
    const unsigned paper = left(3);
    for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>((left(c) * paper + 127) / 255);
    p[3] = 255;
  }
}

/// Exif is not looked at: glTF demands that pictures are taken as they are stored, not as they should be turned.
/// No object with a destructor lives here: errors come back by longjmp.
bool read_rows(jpeg_decompress_struct& info, Errors& errors, std::span<const std::uint8_t> file,
               const ImageHeader& header, std::uint8_t* rgba) {
  if (setjmp(errors.leave) != 0) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, file.data(), file.size());
  jpeg_read_header(&info, TRUE);
  if (info.image_width != header.width || info.image_height != header.height) return false;
  const bool inks = info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK;
  info.out_color_space = inks ? JCS_CMYK : JCS_EXT_RGBA;
  jpeg_start_decompress(&info);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = rgba + std::uint64_t{info.output_scanline} * header.width * 4;
    jpeg_read_scanlines(&info, &row, 1);
    if (inks) rgba_from_cmyk(row, header.width, info.saw_Adobe_marker == TRUE);
  }
  return !errors.cut_off;
}

}  // namespace

bool decode_jpeg(std::span<const std::uint8_t> file, const ImageHeader& header, std::span<std::uint8_t> rgba) {
  if (!has_few_scans(file)) return false;
  jpeg_decompress_struct info{};
  Errors errors{};
  info.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = leave;
  errors.manager.emit_message = note;
  errors.manager.output_message = stay_silent;
  const bool good = read_rows(info, errors, file, header, rgba.data());
  jpeg_destroy_decompress(&info);
  return good;
}

}  // namespace kiln
