#pragma once
// PNG and JPEG, with their sizes known before anything is decoded.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kiln {

struct ImageHeader {
  std::string mime;  // "image/png", "image/jpeg"; "image/ktx2" and "image/webp" are told, not decoded
  std::uint64_t width = 0, height = 0;  // 0 for those that are not decoded
};

inline constexpr std::uint64_t kMaxImageSide = 16384;

/// Tells the type by magic bytes and reads the size; nothing if it is none of these or the header is broken.
std::optional<ImageHeader> read_image_header(std::span<const std::uint8_t> file);

/// RGBA rows, top first, 8 bits, not linearised. Nothing if the data is corrupt or does not keep to its header.
/// Memory: the decoded size, twice it for progressive JPEG; only the decoded rows are held.
std::optional<std::vector<std::uint8_t>> decode_image(std::span<const std::uint8_t> file, const ImageHeader&);

}  // namespace kiln
