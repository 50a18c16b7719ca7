#pragma once
// The bytes of a request head become a Head, or a refusal. Strict on purpose: what two programs could read in two ways
// (two lengths, a bare newline, folded lines, encoded control bytes) is refused.

#include <string_view>

#include "server/http/message.h"

namespace kiln {

struct HeadLimits {
  std::size_t target_bytes = 4096;
  std::size_t fields = 100;
};

/// `text` ends with the empty line. Codes: malformed_request (400), length_required (411, chunked bodies),
/// uri_too_long (414), header_too_large (431), not_implemented (501, a method), version_not_supported (505).
Answer<Head> parse_head(std::string_view text, const HeadLimits& = {});

/// Percent-decodes; nothing when an escape is broken or the result has a control byte or is not UTF-8.
std::optional<std::string> percent_decode(std::string_view, bool plus_is_space = false);

}  // namespace kiln
