#pragma once
// SHA-256, the name of every blob.

#include <cstdint>
#include <span>
#include <string>

#include "core/base/digest.h"

namespace kiln {

/// Hashes a stream of bytes.
class Sha256 {
 public:
  void update(std::span<const std::uint8_t> bytes) { digest_.update(bytes); }
  /// 64 lower-case hex digits. Call once.
  std::string hex();

 private:
  Digest digest_{DigestKind::sha256};
};

std::string sha256_hex(std::span<const std::uint8_t> bytes);

}  // namespace kiln
