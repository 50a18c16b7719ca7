#include "core/artifact/image_decode.h"

#include "core/artifact/jpeg_decode.h"
#include "core/artifact/png_decode.h"

namespace kiln {
namespace {

/// Whether so few bytes can hold so much: deflate reaches 1032 : 1, a JPEG takes at least a bit for 64 pixels.
/// Otherwise a header alone could claim memory.
bool is_plausible(std::span<const std::uint8_t> file, const ImageHeader& header) {
  constexpr std::uint64_t kMostPerByte = 1040;
  const std::uint64_t bits_per_pixel = header.mime == "image/png" ? file[24] : 8;  // of one channel at least
  return header.width * header.height * bits_per_pixel / 8 <= file.size() * kMostPerByte;
}

}  // namespace

std::optional<std::vector<std::uint8_t>> decode_image(std::span<const std::uint8_t> file, const ImageHeader& header) {
  if (!is_plausible(file, header)) return std::nullopt;
  std::vector<std::uint8_t> rgba(header.width * header.height * 4);
  const bool good = header.mime == "image/png" ? decode_png(file, header, rgba) : decode_jpeg(file, header, rgba);
  if (!good) return std::nullopt;
  return rgba;
}

}  // namespace kiln
