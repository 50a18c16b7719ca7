#pragma once
// OpenEXR files of one or more parts, half or float, as plain data.

#include <map>
#include <string>
#include <vector>

#include "core/artifact/import.h"

namespace kiln {

/// One part: a picture with up to four channels named R, G, B, A in this order.
struct ExrPart {
  std::string name;
  int width = 0, height = 0, channels = 3;
  std::vector<float> pixels;                // [(row * width + column) * channels + channel], top row first
  std::map<std::string, std::string> text;  // header attributes of type string
  bool half = true;                         // as written; else 32-bit floats
};

struct ExrLimits {
  std::size_t most_parts = 64;
  std::uint64_t most_pixels = std::uint64_t{1} << 28;  // of all parts together
};

/// ZIP (16 scan lines a block), increasing y. Values beyond 65504 must not be among halves.
/// Repeat  same bytes for same parts
Bytes write_exr_parts(const std::vector<ExrPart>&);

/// Reads what write_exr_parts writes, half or float: scan lines, channels out of R, G, B, A (the first `channels` of
/// them). Deep and tiled files are refused by their version flags before OpenEXR sees them.
/// Fails  exr_unsupported, exr_invalid, image_too_large
Result<std::vector<ExrPart>> read_exr_parts(std::span<const std::uint8_t> file, const std::string& name,
                                            const ExrLimits& = {});

/// Whether the version flags say multi-part.
bool looks_like_exr_parts(std::span<const std::uint8_t> file);

}  // namespace kiln
