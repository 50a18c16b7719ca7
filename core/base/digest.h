#pragma once
// Digests of a stream of bytes. SHA-256 is ours (sha256.h); SHA-1 is what the tus protocol asks every server to check.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace kiln {

enum class DigestKind { sha1, sha256 };

class Digest {
 public:
  explicit Digest(DigestKind);
  ~Digest();
  Digest(Digest&&) noexcept;
  Digest& operator=(Digest&&) noexcept;
  void update(std::span<const std::uint8_t> bytes);
  /// 20 or 32 bytes. Call once.
  std::vector<std::uint8_t> bytes();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
