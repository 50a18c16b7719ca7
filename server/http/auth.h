#pragma once
// Bearer tokens. Kept and compared as SHA-256, so neither memory dumps nor timing tell one.

#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/http/message.h"

namespace kiln {

/// The hashes of the tokens in a file, one of 43 characters [A-Za-z0-9_-] a line; empty lines and #-comments are
/// skipped. Fails  bad_token_file: unreadable, without any token, or with a line that is none.
Result<std::vector<std::string>> read_token_hashes(const std::string& file);

/// True when the request carries one of the tokens: `Authorization: Bearer TOKEN`, or Basic with the token as password
/// (what a browser sends, for pages and event streams too).
bool carries_token(const Head&, const std::vector<std::string>& hashes);

}  // namespace kiln
