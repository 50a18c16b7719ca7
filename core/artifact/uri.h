#pragma once
// URI references as glTF uses them.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// "a%20b" -> "a b". Nothing if an escape is broken or stands for NUL.
std::optional<std::string> percent_decode(std::string_view text);

/// Whether a decoded reference stays below its own folder: relative, forward slashes, no "..", no scheme.
bool is_plain_relative_path(std::string_view path);

bool is_data_uri(std::string_view uri);

/// The payload of "data:[type][;charset=x];base64,..."; nothing if it is broken.
std::optional<std::vector<std::uint8_t>> decode_data_uri(std::string_view uri);

}  // namespace kiln
