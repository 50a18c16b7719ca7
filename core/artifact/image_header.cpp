#include <algorithm>
#include <array>

#include "core/artifact/image_decode.h"

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

template <std::size_t N>
bool starts_with(Span file, const std::array<std::uint8_t, N>& magic) {
  return file.size() >= N && std::equal(magic.begin(), magic.end(), file.begin());
}

std::uint64_t big_endian(Span file, std::size_t at, std::size_t bytes) {
  std::uint64_t x = 0;
  for (std::size_t i = 0; i < bytes; ++i) x = (x << 8) | file[at + i];
  return x;
}

/// Signature, then IHDR: length 13, "IHDR", width, height.
std::optional<ImageHeader> png_header(Span file) {
  constexpr std::size_t kIhdrEnd = 33;
  if (file.size() < kIhdrEnd || big_endian(file, 8, 4) != 13 || big_endian(file, 12, 4) != 0x49484452)
    return std::nullopt;
  return ImageHeader{"image/png", big_endian(file, 16, 4), big_endian(file, 20, 4)};
}

/// Walks the segments to the first frame header (SOF0..SOF15 without DHT, JPG, DAC).
std::optional<ImageHeader> jpeg_header(Span file) {
  std::size_t at = 2;
  while (at + 4 <= file.size()) {
    if (file[at] != 0xFF) return std::nullopt;
    const std::uint8_t marker = file[at + 1];
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    const std::uint64_t length = big_endian(file, at + 2, 2);
    const bool frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame) {
      if (at + 9 > file.size()) return std::nullopt;
      return ImageHeader{"image/jpeg", big_endian(file, at + 7, 2), big_endian(file, at + 5, 2)};
    }
    if (length < 2 || marker == 0xD9 || marker == 0xDA) return std::nullopt;
    at += 2 + length;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ImageHeader> read_image_header(Span file) {
  constexpr std::array<std::uint8_t, 8> kPng{0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
  constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};
  constexpr std::array<std::uint8_t, 12> kKtx2{0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, 0x0D, 0x0A, 0x1A, 0x0A};
  constexpr std::array<std::uint8_t, 4> kRiff{'R', 'I', 'F', 'F'};
  if (starts_with(file, kPng)) return png_header(file);
  if (starts_with(file, kJpeg)) return jpeg_header(file);
  if (starts_with(file, kKtx2)) return ImageHeader{"image/ktx2", 0, 0};
  if (starts_with(file, kRiff) && file.size() >= 12 && big_endian(file, 8, 4) == 0x57454250)
    return ImageHeader{"image/webp", 0, 0};
  return std::nullopt;
}

}  // namespace kiln
