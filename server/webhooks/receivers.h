#pragma once
// Who is told when a job ends: a file of the operator's. No address ever comes from a request.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace kiln {

struct WebhookReceiver {
  std::string url;
  std::vector<std::uint8_t> key;      // of its signatures
  std::optional<std::string> tenant;  // whose jobs it hears of; nothing: everybody's
};

/// A receiver a line: its address, its secret, and tenant=NAME where it hears of one tenant alone; empty lines and
/// #-comments are skipped. Addresses are https://, or http:// too where `private_too`; none is listed twice.
/// Fails  bad_webhook_file: unreadable, without any receiver, more than 64, or with a line that is none.
Result<std::vector<WebhookReceiver>> read_webhook_receivers(const std::string& file, bool private_too);

}  // namespace kiln
