#include "core/artifact/image_decode.h"

#include <algorithm>
#include <limits>
#include <memory>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
#define STBI_NO_HDR
#define STBI_MAX_DIMENSIONS 16384
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

std::uint64_t big_endian32(Span file, std::size_t at) {
  return std::uint64_t{file[at]} << 24 | std::uint64_t{file[at + 1]} << 16 | std::uint64_t{file[at + 2]} << 8 |
         file[at + 3];
}

/// The IDAT chunks of a PNG, joined.
std::vector<std::uint8_t> png_stream(Span file) {
  constexpr std::uint64_t kIdat = 0x49444154, kEnd = 0x49454E44;
  std::vector<std::uint8_t> out;
  for (std::size_t at = 8; at + 12 <= file.size();) {
    const std::uint64_t length = big_endian32(file, at), type = big_endian32(file, at + 4);
    if (type == kEnd || length > file.size() - at - 12) break;
    const Span data = file.subspan(at + 8, length);
    if (type == kIdat) out.insert(out.end(), data.begin(), data.end());
    at += 12 + length;
  }
  return out;
}

/// Upper bound of the inflated rows of a PNG: each with a filter byte, and seven passes' worth of rounding when
/// interlaced.
std::uint64_t png_raw_bytes(Span file, const ImageHeader& header) {
  const std::uint64_t depth = file[24], color = file[25], interlaced = file[28];
  const std::uint64_t channels = color == 2 ? 3 : color == 4 ? 2 : color == 6 ? 4 : 1;
  const std::uint64_t rows = header.height * ((header.width * channels * depth + 7) / 8 + 1);
  return interlaced == 0 ? rows : rows + 2 * header.height * (channels * depth / 8 + 2) * 2 + 64;
}

/// stb lets an image inflate without bound: try it first into a buffer that the header's size fills.
bool png_keeps_to_its_size(Span file, const ImageHeader& header) {
  const std::vector<std::uint8_t> stream = png_stream(file);
  const std::uint64_t raw = png_raw_bytes(file, header);
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<int>::max());
  if (stream.empty() || stream.size() > kMax || raw > kMax) return false;
  const auto buffer = std::make_unique_for_overwrite<char[]>(raw);
  return stbi_zlib_decode_buffer(buffer.get(), static_cast<int>(raw), reinterpret_cast<const char*>(stream.data()),
                                 static_cast<int>(stream.size())) >= 0;
}

}  // namespace

std::optional<std::vector<std::uint8_t>> decode_image(Span file, const ImageHeader& header) {
  if (file.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return std::nullopt;
  if (header.mime == "image/png" && !png_keeps_to_its_size(file, header)) return std::nullopt;
  int width = 0, height = 0, channels = 0;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(file.data(), static_cast<int>(file.size()), &width, &height, &channels, 4),
      &stbi_image_free);
  if (!pixels || static_cast<std::uint64_t>(width) != header.width ||
      static_cast<std::uint64_t>(height) != header.height) {
    return std::nullopt;
  }
  return std::vector<std::uint8_t>(pixels.get(), pixels.get() + header.width * header.height * 4);
}

}  // namespace kiln
