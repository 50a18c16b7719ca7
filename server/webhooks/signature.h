#pragma once
// Signatures of Standard Webhooks (standardwebhooks.com), version 1: HMAC-SHA256 over "id.timestamp.body".

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace kiln {

/// The key in "whsec_" + base64 of 24 to 64 bytes. Fails  bad_webhook_secret
Result<std::vector<std::uint8_t>> read_webhook_secret(std::string_view text);

/// What is signed: one try to deliver one message.
struct SignedContent {
  std::string_view id;
  std::int64_t timestamp_s = 0;  // of the try
  std::string_view body;
};

/// The value of webhook-signature: "v1," + base64.
std::string webhook_signature(std::span<const std::uint8_t> key, const SignedContent&);

}  // namespace kiln
