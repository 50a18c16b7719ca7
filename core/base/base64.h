#pragma once
// Base64 (RFC 4648), in its plain and its URL-safe alphabet.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// The bytes; nothing for a letter of neither alphabet or a length that no bytes have. Padding may be missing.
std::optional<std::vector<std::uint8_t>> base64_decode(std::string_view text);

/// In the plain alphabet, padded.
std::string base64_encode(std::span<const std::uint8_t> bytes);

}  // namespace kiln
