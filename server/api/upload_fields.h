#pragma once
// The header fields of the tus protocol 1.0 (uploads in pieces), read strictly.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/digest.h"
#include "server/api/problem.h"

namespace kiln {

inline constexpr const char* kTusVersion = "1.0.0";
inline constexpr std::size_t kMaxUploadMetadata = 4096;  // bytes of the field

/// Upload-Metadata: "filename c2NlbmUuZ2xi,sha256 YWJj...": names with base64 values, each name once.
struct UploadMetadata {
  std::string text;    // as it came
  std::string sha256;  // of the whole file, 64 hex digits; empty: not told
};
Answer<UploadMetadata> parse_upload_metadata(std::string_view);

/// Upload-Checksum: "sha256 <base64>" or "sha1 <base64>" of one piece.
struct UploadChecksum {
  DigestKind kind = DigestKind::sha256;
  std::vector<std::uint8_t> digest;
};
/// Nothing for an absent (empty) field.
Answer<std::optional<UploadChecksum>> parse_upload_checksum(std::string_view);

/// "Fri, 27 Nov 2026 01:30:00 GMT" (RFC 9110 5.6.7).
std::string http_date(std::int64_t unix_s);

}  // namespace kiln
