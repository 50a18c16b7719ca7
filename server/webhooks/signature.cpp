#include "server/webhooks/signature.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>

#include "core/base/base64.h"
#include "core/base/expects.h"

namespace kiln {

Result<std::vector<std::uint8_t>> read_webhook_secret(std::string_view text) {
  constexpr std::string_view kPrefix = "whsec_";
  if (text.starts_with(kPrefix)) {
    auto key = base64_decode(text.substr(kPrefix.size()));
    if (key && key->size() >= 24 && key->size() <= 64) return std::move(*key);
  }
  return fault("bad_webhook_secret", "a secret is whsec_ and 24 to 64 bytes in base64");
}

std::string webhook_signature(std::span<const std::uint8_t> key, const SignedContent& content) {
  const std::string text =
      std::string(content.id) + "." + std::to_string(content.timestamp_s) + "." + std::string(content.body);
  std::array<std::uint8_t, 32> digest{};
  unsigned length = 0;
  EXPECTS(HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
               reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), digest.data(), &length) != nullptr);
  return "v1," + base64_encode(digest);
}

}  // namespace kiln
