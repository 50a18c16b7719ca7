#pragma once
// Local files, whole.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client_cli/failure.h"

namespace kiln {

/// "-" is standard input. Fails  not_found, unreadable_file (with the path as its place)
Outcome<std::vector<std::uint8_t>> read_file(const std::string& path);
Outcome<std::string> read_text(const std::string& path);

/// Writes beside `path` and renames: a reader never sees half a file. "" and "-" are standard output.
Outcome<void> write_file(const std::string& path, std::span<const std::uint8_t> bytes);
Outcome<void> write_text(const std::string& path, std::string_view text);

Outcome<void> make_folder(const std::string& path);
/// Whether make_folder would do: asked before a long bake, and nothing is made.
Outcome<void> check_folder(const std::string& path);
bool file_exists(const std::string& path);

/// The last component of a path.
std::string base_name(const std::string& path);

}  // namespace kiln
