#include "server/http/tar.h"

#include <array>
#include <cstdio>
#include <cstring>

#include "core/base/expects.h"

namespace kiln {
namespace {

void put(std::string& block, std::size_t at, const std::string& text) { block.replace(at, text.size(), text); }

std::string octal(std::uint64_t value, int digits) {
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%0*llo", digits, static_cast<unsigned long long>(value));
  return text.data();
}

}  // namespace

std::string tar_header(const TarEntry& entry) {
  EXPECTS(entry.name.size() <= 100 && entry.bytes < (8ull << 30));
  std::string block(kTarBlock, '\0');
  put(block, 0, entry.name);
  put(block, 100, "0000644");
  put(block, 108, "0000000");
  put(block, 116, "0000000");
  put(block, 124, octal(entry.bytes, 11));
  put(block, 136, octal(static_cast<std::uint64_t>(entry.modified_s), 11));
  put(block, 148, "        ");  // the checksum counts as spaces while it is made
  put(block, 156, "0");
  put(block, 257,
      std::string("ustar\0"
                  "00",
                  8));
  std::uint64_t sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  put(block, 148, octal(sum, 6) + std::string("\0 ", 2));
  return block;
}

std::uint64_t tar_padding(std::uint64_t bytes) { return (kTarBlock - bytes % kTarBlock) % kTarBlock; }

}  // namespace kiln
