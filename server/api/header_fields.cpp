#include "server/api/header_fields.h"

#include <algorithm>
#include <charconv>

namespace kiln {
namespace {

constexpr std::string_view kSpace = " \t";

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

/// Calls visit for each comma-separated member until it returns true; true if one did.
template <class Visit>
bool any_member(std::string_view list, Visit visit) {
  while (true) {
    const std::size_t comma = list.find(',');
    if (visit(trim(list.substr(0, comma)))) return true;
    if (comma == std::string_view::npos) return false;
    list.remove_prefix(comma + 1);
  }
}

std::string_view opaque(std::string_view etag) { return etag.starts_with("W/") ? etag.substr(2) : etag; }

tl::unexpected<Problem> no_range(std::uint64_t size) {
  return refuse("range_not_satisfiable",
                "only one byte range inside the " + std::to_string(size) + " bytes can be served");
}

}  // namespace

std::optional<std::uint64_t> parse_decimal(std::string_view text) {
  std::uint64_t value = 0;
  const char* end = text.data() + text.size();
  if (text.empty() || text.size() > 18) return std::nullopt;
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

Answer<ByteRange> parse_range(std::string_view value, std::uint64_t size) {
  value = trim(value);
  const std::size_t dash = value.find('-');
  if (!value.starts_with("bytes=") || dash == std::string_view::npos || size == 0) return no_range(size);
  const std::string_view first_text = value.substr(6, dash - 6);
  const std::string_view last_text = value.substr(dash + 1);
  const auto first = parse_decimal(first_text);
  const auto last = parse_decimal(last_text);
  if ((!first && !first_text.empty()) || (!last && !last_text.empty())) return no_range(size);
  if (!first) {  // the last N bytes
    if (!last || *last == 0) return no_range(size);
    return ByteRange{size - std::min(*last, size), size - 1};
  }
  if (*first >= size || (last && *last < *first)) return no_range(size);
  return ByteRange{*first, last ? std::min(*last, size - 1) : size - 1};
}

Answer<ContentRange> parse_content_range(std::string_view value) {
  value = trim(value);
  const std::size_t dash = value.find('-');
  const std::size_t slash = value.find('/');
  if (value.starts_with("bytes ") && dash != std::string_view::npos && slash != std::string_view::npos &&
      dash < slash) {
    const auto first = parse_decimal(value.substr(6, dash - 6));
    const auto last = parse_decimal(value.substr(dash + 1, slash - dash - 1));
    const auto total = parse_decimal(value.substr(slash + 1));
    if (first && last && total && *first <= *last && *last < *total) return ContentRange{{*first, *last}, *total};
  }
  return refuse("bad_header", "Content-Range must read: bytes FIRST-LAST/TOTAL");
}

bool etag_listed(std::string_view list, std::string_view etag) {
  return any_member(list, [&](std::string_view member) { return member == "*" || opaque(member) == opaque(etag); });
}

bool if_range_allows(std::string_view value, std::string_view etag) {
  return !etag.starts_with("W/") && trim(value) == etag;
}

std::optional<int> prefer_wait(std::string_view value) {
  std::optional<int> wait;
  any_member(value, [&](std::string_view member) {
    if (!member.starts_with("wait=")) return false;
    if (const auto seconds = parse_decimal(member.substr(5)))
      wait = static_cast<int>(std::min<std::uint64_t>(*seconds, kMaxWait));
    return true;
  });
  return wait;
}

Answer<int> parse_wait(std::string_view value) {
  if (const auto seconds = parse_decimal(value)) return static_cast<int>(std::min<std::uint64_t>(*seconds, kMaxWait));
  return refuse("bad_query", "wait must be a number of seconds",
                {{"?wait", "must be an integer of at least 0", "\"" + std::string(value) + "\"", "0 to 60"}});
}

bool is_idempotency_key(std::string_view key) {
  return !key.empty() && key.size() <= 255 &&
         std::all_of(key.begin(), key.end(), [](char c) { return c > ' ' && c < 127; });
}

}  // namespace kiln
