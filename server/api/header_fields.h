#pragma once
// Request header fields with a grammar of their own, read strictly.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/api/problem.h"

namespace kiln {

/// A part of a representation: bytes [first, last].
struct ByteRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  friend bool operator==(const ByteRange&, const ByteRange&) = default;
};

/// Range: bytes=0-99 | bytes=100- | bytes=-100, against a representation of `size` bytes (RFC 9110 14.1).
/// The end is clamped. Fails  range_not_satisfiable (416): more than one range, outside, or not a range at all.
Answer<ByteRange> parse_range(std::string_view value, std::uint64_t size);

/// Content-Range: bytes 0-99/1000 of an upload.
struct ContentRange {
  ByteRange range;
  std::uint64_t total = 0;
};
Answer<ContentRange> parse_content_range(std::string_view value);

/// True when an If-None-Match list names `etag` (weak comparison) or is "*".
bool etag_listed(std::string_view list, std::string_view etag);

/// True when If-Range names exactly this strong `etag`, so that the Range may be used.
bool if_range_allows(std::string_view value, std::string_view etag);

/// Seconds of `Prefer: respond-async, wait=10`; nothing when there is no such preference.
std::optional<int> prefer_wait(std::string_view value);

/// Seconds of ?wait=N: an integer, 0..kMaxWait; larger is clamped.
inline constexpr int kMaxWait = 60;
Answer<int> parse_wait(std::string_view value);

/// 1..255 visible ASCII characters.
bool is_idempotency_key(std::string_view);
/// A decimal number of at most 18 digits and nothing else.
std::optional<std::uint64_t> parse_decimal(std::string_view);

}  // namespace kiln
