#include "core/base/digest.h"

#include <openssl/evp.h>

#include "core/base/expects.h"

namespace kiln {

struct Digest::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  ~State() { EVP_MD_CTX_free(context); }
};

Digest::Digest(DigestKind kind) : state_(std::make_unique<State>()) {
  EXPECTS(EVP_DigestInit_ex(state_->context, kind == DigestKind::sha1 ? EVP_sha1() : EVP_sha256(), nullptr) == 1);
}
Digest::~Digest() = default;
Digest::Digest(Digest&&) noexcept = default;
Digest& Digest::operator=(Digest&&) noexcept = default;

void Digest::update(std::span<const std::uint8_t> bytes) {
  EXPECTS(EVP_DigestUpdate(state_->context, bytes.data(), bytes.size()) == 1);
}

std::vector<std::uint8_t> Digest::bytes() {
  std::vector<std::uint8_t> out(EVP_MAX_MD_SIZE);
  unsigned size = 0;
  EXPECTS(EVP_DigestFinal_ex(state_->context, out.data(), &size) == 1);
  out.resize(size);
  return out;
}

}  // namespace kiln
