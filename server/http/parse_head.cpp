#include "server/http/parse_head.h"

#include <algorithm>
#include <cctype>

#include "server/api/header_fields.h"

namespace kiln {
namespace {

tl::unexpected<Problem> malformed(const char* what) { return refuse("malformed_request", what); }

bool is_token(std::string_view text) {
  constexpr std::string_view kMarks = "!#$%&'*+-.^_`|~";
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || kMarks.find(c) != std::string_view::npos;
  });
}

bool is_method(std::string_view text) {
  constexpr std::string_view kMethods[] = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};
  return std::ranges::find(kMethods, text) != std::end(kMethods);
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

bool is_field_value(std::string_view text) {
  return std::none_of(text.begin(), text.end(), [](char c) { return is_control(c) && c != '\t'; });
}

/// Some readers decode %0d%0a in a field value: nobody honest sends it.
bool hides_line_break(std::string_view text) {
  for (std::size_t at = text.find('%'); at != std::string_view::npos; at = text.find('%', at + 1)) {
    const std::string_view code = text.substr(at + 1, 2);
    if (code == "00" || code == "0a" || code == "0A" || code == "0d" || code == "0D") return true;
  }
  return false;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Length of the UTF-8 sequence at `text`, 0 when it is none (RFC 3629: no surrogates, no overlong forms).
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto tail = [&](std::size_t i) { return i < text.size() && (byte(i) & 0xc0) == 0x80; };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return tail(1) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    if (!tail(1) || !tail(2)) return 0;
    const bool overlong = first == 0xe0 && byte(1) < 0xa0;
    const bool surrogate = first == 0xed && byte(1) > 0x9f;
    return overlong || surrogate ? 0 : 3;
  }
  if (first >= 0xf0 && first <= 0xf4) {
    if (!tail(1) || !tail(2) || !tail(3)) return 0;
    const bool outside = (first == 0xf0 && byte(1) < 0x90) || (first == 0xf4 && byte(1) > 0x8f);
    return outside ? 0 : 4;
  }
  return 0;
}

bool is_clean_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0 || is_control(text[0])) return false;
    text.remove_prefix(length);
  }
  return true;
}

/// Takes the text up to the next CR LF out of `rest`; nothing when a line ends otherwise.
std::optional<std::string_view> take_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos || end == 0 || rest[end - 1] != '\r') return std::nullopt;
  const std::string_view line = rest.substr(0, end - 1);
  rest.remove_prefix(end + 1);
  return line;
}

Answer<void> parse_query(std::string_view query, Head& head) {
  while (!query.empty()) {
    const std::size_t end = std::min(query.find('&'), query.size());
    const std::string_view pair = query.substr(0, end);
    query.remove_prefix(std::min(end + 1, query.size()));
    if (pair.empty()) continue;
    const std::size_t equals = std::min(pair.find('='), pair.size());
    auto name = percent_decode(pair.substr(0, equals), true);
    auto value = percent_decode(pair.substr(std::min(equals + 1, pair.size())), true);
    if (!name || !value) return malformed("the query has a broken escape, a control byte or is no UTF-8");
    head.params.emplace_back(std::move(*name), std::move(*value));
  }
  return {};
}

Answer<void> parse_target(std::string_view target, const HeadLimits& limits, Head& head) {
  if (target.size() > limits.target_bytes)
    return refuse("uri_too_long", "a request target may have " + std::to_string(limits.target_bytes) + " bytes");
  if (!target.starts_with('/')) return malformed("the request target must be a path");
  target = target.substr(0, target.find('#'));
  const std::size_t question = std::min(target.find('?'), target.size());
  auto path = percent_decode(target.substr(0, question));
  if (!path) return malformed("the path has a broken escape, a control byte or is no UTF-8");
  head.path = std::move(*path);
  head.raw_path = target.substr(0, question);
  return parse_query(target.substr(std::min(question + 1, target.size())), head);
}

Answer<void> parse_request_line(std::string_view line, const HeadLimits& limits, Head& head) {
  const std::size_t first = line.find(' ');
  const std::size_t last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) return malformed("the request line has no three parts");
  const std::string_view target = line.substr(first + 1, last - first - 1);
  const std::string_view version = line.substr(last + 1);
  if (!is_token(line.substr(0, first)) || target.empty() || !is_clean_utf8(target) ||
      target.find(' ') != std::string_view::npos)
    return malformed("the request line is malformed");
  if (!version.starts_with("HTTP/")) return malformed("the request line names no HTTP version");
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return refuse("version_not_supported", "HTTP/1.1 is spoken here");
  if (!is_method(line.substr(0, first))) return refuse("not_implemented", "no address here takes this method");
  head.method = line.substr(0, first);
  return parse_target(target, limits, head);
}

Answer<void> parse_field(std::string_view line, Head& head) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
    return malformed("a header line is malformed");
  std::string_view value = line.substr(colon + 1);
  while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
  while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
  if (!is_field_value(value) || hides_line_break(value)) return malformed("a header value has control bytes");
  std::string name(line.substr(0, colon));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  head.fields.push_back({std::move(name), std::string(value)});
  return {};
}

/// How long the body is must be said once and plainly.
Answer<void> parse_length(Head& head) {
  const bool chunked = count_fields(head, "transfer-encoding") > 0;
  const std::size_t lengths = count_fields(head, "content-length");
  if (lengths > 1 || (chunked && lengths > 0)) return malformed("the body's length is given in two ways");
  if (chunked) return refuse("length_required", "bodies need a Content-Length; chunked ones are not taken");
  if (lengths == 0) return {};
  head.content_length = parse_decimal(field_of(head, "content-length"));
  if (!head.content_length) return malformed("Content-Length must be one decimal number");
  return {};
}

}  // namespace

std::optional<std::string> percent_decode(std::string_view text, bool plus_is_space) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+' && plus_is_space) {
      decoded.push_back(' ');
    } else if (text[i] != '%') {
      decoded.push_back(text[i]);
    } else {
      const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) return std::nullopt;
      decoded.push_back(static_cast<char>(high * 16 + low));
      i += 2;
    }
  }
  if (!is_clean_utf8(decoded)) return std::nullopt;
  return decoded;
}

Answer<Head> parse_head(std::string_view text, const HeadLimits& limits) {
  Head head;
  const auto request_line = take_line(text);
  if (!request_line) return malformed("lines must end with CR LF");
  if (auto parsed = parse_request_line(*request_line, limits, head); !parsed)
    return tl::make_unexpected(parsed.error());
  while (true) {
    const auto line = take_line(text);
    if (!line) return malformed("lines must end with CR LF");
    if (line->empty()) break;
    if (head.fields.size() == limits.fields)
      return refuse("header_too_large", "a request may have " + std::to_string(limits.fields) + " header fields");
    if (auto parsed = parse_field(*line, head); !parsed) return tl::make_unexpected(parsed.error());
  }
  if (auto parsed = parse_length(head); !parsed) return tl::make_unexpected(parsed.error());
  const std::size_t hosts = count_fields(head, "host");
  if (hosts > 1) return malformed("Host is given twice");
  if (hosts == 0 && request_line->ends_with("1.1")) return malformed("Host is missing");
  return head;
}

}  // namespace kiln
