#pragma once
// POSIX ustar, the parts that a bundle of plain files needs.

#include <cstdint>
#include <string>

namespace kiln {

inline constexpr std::uint64_t kTarBlock = 512;
inline constexpr std::uint64_t kTarEnd = 2 * kTarBlock;  // zero bytes after the last file

struct TarEntry {
  std::string name;         // at most 100 bytes
  std::uint64_t bytes = 0;  // below 8 GiB
  std::int64_t modified_s = 0;
};

/// The 512 bytes before a file.
std::string tar_header(const TarEntry&);
/// Zero bytes after a file of that size.
std::uint64_t tar_padding(std::uint64_t bytes);

}  // namespace kiln
