#include "server/http/multipart.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>

#include "server/http/parse_head.h"

namespace kiln {
namespace {

constexpr std::size_t kPieceBytes = 65536;
constexpr std::size_t kPartHeadBytes = 4096;
constexpr int kMaxParts = 1000;

using Params = std::vector<std::pair<std::string, std::string>>;

tl::unexpected<Problem> malformed(const char* what) { return refuse("malformed_multipart", what); }

bool starts_with_ci(std::string_view text, std::string_view prefix) {
  return text.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), text.begin(), [](char a, char b) {
           return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
         });
}

std::string_view skip_space(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  return first == std::string_view::npos ? std::string_view() : text.substr(first);
}

/// A token or a quoted string at the start of `rest`, taken out of it.
std::optional<std::string> take_value(std::string_view& rest) {
  std::string value;
  if (!rest.starts_with('"')) {
    const std::size_t end = std::min(rest.find_first_of("; \t"), rest.size());
    value = rest.substr(0, end);
    rest.remove_prefix(end);
    return value;
  }
  for (std::size_t i = 1; i < rest.size(); ++i) {
    if (rest[i] == '"') {
      rest.remove_prefix(i + 1);
      return value;
    }
    if (rest[i] == '\\' && i + 1 < rest.size() && (rest[i + 1] == '"' || rest[i + 1] == '\\')) ++i;
    value.push_back(rest[i]);
  }
  return std::nullopt;
}

/// Parameters of "form-data; name=x; filename=y" (after its first word); nothing when malformed.
std::optional<Params> parse_params(std::string_view rest) {
  Params params;
  rest = skip_space(rest);
  while (!rest.empty()) {
    if (!rest.starts_with(';')) return std::nullopt;
    rest = skip_space(rest.substr(1));
    const std::size_t equals = rest.find('=');
    if (equals == std::string_view::npos) return rest.empty() ? std::optional(params) : std::nullopt;
    std::string name(rest.substr(0, equals));
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    rest.remove_prefix(equals + 1);
    auto value = take_value(rest);
    if (!value) return std::nullopt;
    params.emplace_back(std::move(name), std::move(*value));
    rest = skip_space(rest);
  }
  return params;
}

std::string param_or_empty(const Params& params, std::string_view name) {
  for (const auto& [key, value] : params)
    if (key == name) return value;
  return {};
}

bool is_boundary(std::string_view text) {
  return !text.empty() && text.size() <= 70 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 127; });
}

/// A name that people may read and files may have: UTF-8 without control bytes. Checked by the decoder of targets.
bool is_clean_name(std::string name) {
  std::replace(name.begin(), name.end(), '%', ' ');
  return name.size() <= 512 && percent_decode(name).has_value();
}

Answer<PartHead> parse_part_head(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find("\r\n"), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 2, text.size()));
    if (!starts_with_ci(line, "content-disposition:")) continue;
    const std::string_view value = skip_space(line.substr(20));
    if (!starts_with_ci(value, "form-data")) break;
    const auto params = parse_params(value.substr(9));
    if (!params) break;
    PartHead head{param_or_empty(*params, "name"), param_or_empty(*params, "filename")};
    if (head.name.empty() || !is_clean_name(head.name) || !is_clean_name(head.filename)) break;
    return head;
  }
  return malformed("a part lacks a Content-Disposition of form-data with a clean name");
}

}  // namespace

Answer<MultipartReader> MultipartReader::open(const Head& head, BodySource& body) {
  const std::string_view type = field_of(head, "content-type");
  const std::size_t semicolon = std::min(type.find(';'), type.size());
  const auto params = parse_params(type.substr(semicolon));
  const std::string boundary = params ? param_or_empty(*params, "boundary") : std::string();
  if (!is_boundary(boundary)) return malformed("Content-Type names no boundary");
  return MultipartReader(body, "\r\n--" + boundary);
}

/// Reads one piece more; false at the end of the body.
Answer<bool> MultipartReader::fill() {
  const std::size_t old = buffer_.size();
  buffer_.resize(old + kPieceBytes);
  auto got = body_->read({reinterpret_cast<std::uint8_t*>(buffer_.data()) + old, kPieceBytes});
  buffer_.resize(old + (got ? *got : 0));
  if (!got) return tl::make_unexpected(got.error());
  return *got > 0;
}

Answer<std::size_t> MultipartReader::read(std::span<std::uint8_t> out) {
  if (!in_part_ || out.empty()) return std::size_t{0};
  while (true) {
    const std::size_t found = buffer_.find(delimiter_);
    const bool ends = found != std::string::npos;
    // A delimiter may begin in the last bytes: keep as many back.
    const std::size_t safe = ends ? found : buffer_.size() - std::min(buffer_.size(), delimiter_.size() - 1);
    if (safe > 0) {
      const std::size_t count = std::min(safe, out.size());
      std::memcpy(out.data(), buffer_.data(), count);
      buffer_.erase(0, count);
      return count;
    }
    if (ends) {
      in_part_ = false;
      return std::size_t{0};
    }
    auto more = fill();
    if (!more) return tl::make_unexpected(more.error());
    if (!*more) return malformed("the form ends inside a part");
  }
}

/// Skips the delimiter that the buffer starts with; false when it was the last one.
Answer<bool> MultipartReader::after_delimiter() {
  buffer_.erase(0, delimiter_.size());
  while (buffer_.size() < 2) {
    auto more = fill();
    if (!more) return more;
    if (!*more) return malformed("the form ends at a boundary");
  }
  if (buffer_.starts_with("--")) return false;
  if (!buffer_.starts_with("\r\n")) return malformed("a boundary is followed by neither a part nor the end");
  return true;
}

Answer<std::string> MultipartReader::read_part_head() {
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
    if (buffer_.size() > kPartHeadBytes) break;
    auto more = fill();
    if (!more) return tl::make_unexpected(more.error());
    if (!*more) return malformed("the form ends inside a part's head");
  }
  if (end == std::string::npos || end > kPartHeadBytes) return malformed("a part's head is too long");
  std::string text = buffer_.substr(2, end > 2 ? end - 2 : 0);
  buffer_.erase(0, end + 4);
  return text;
}

Answer<std::optional<PartHead>> MultipartReader::next() {
  if (!started_) {  // what stands before the first delimiter is skipped like a part
    started_ = true;
    in_part_ = true;
  }
  std::array<std::uint8_t, kPieceBytes> skipped;
  while (true) {
    auto got = read(skipped);
    if (!got) return tl::make_unexpected(got.error());
    if (*got == 0) break;
  }
  auto more = after_delimiter();
  if (!more) return tl::make_unexpected(more.error());
  if (!*more) {  // what follows the last delimiter belongs to no part
    while (true) {
      auto rest = body_->read(skipped);
      if (!rest) return tl::make_unexpected(rest.error());
      if (*rest == 0) return std::optional<PartHead>();
    }
  }
  if (++parts_ > kMaxParts) return malformed("the form has too many parts");
  auto text = read_part_head();
  if (!text) return tl::make_unexpected(text.error());
  auto head = parse_part_head(*text);
  if (!head) return tl::make_unexpected(head.error());
  in_part_ = true;
  return std::optional<PartHead>(std::move(*head));
}

Answer<std::string> read_part_text(MultipartReader& form, std::size_t limit) {
  std::string text;
  std::array<std::uint8_t, 8192> piece;
  while (true) {
    auto got = form.read(piece);
    if (!got) return tl::make_unexpected(got.error());
    if (*got == 0) return text;
    if (text.size() + *got > limit)
      return refuse("too_large", "this part may have " + std::to_string(limit) + " bytes");
    text.append(reinterpret_cast<const char*>(piece.data()), *got);
  }
}

}  // namespace kiln
