#include "core/base/sha256.h"

namespace kiln {

std::string Sha256::hex() {
  std::string text;
  for (const std::uint8_t byte : digest_.bytes()) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

std::string sha256_hex(std::span<const std::uint8_t> bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.hex();
}

}  // namespace kiln
