#include "server/blobs/s3_list.h"

#include <array>
#include <charconv>
#include <ctime>
#include <optional>
#include <utility>

namespace kiln {
namespace {

/// What stands between <name> and </name>, the first time; nothing when it is not there.
std::optional<std::string_view> element(std::string_view xml, const std::string& name) {
  const std::string open = "<" + name + ">";
  const auto begin = xml.find(open);
  if (begin == std::string_view::npos) return std::nullopt;
  const auto rest = xml.substr(begin + open.size());
  const auto end = rest.find("</" + name + ">");
  if (end == std::string_view::npos) return std::nullopt;
  return rest.substr(0, end);
}

std::string unescaped(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, char>, 5> kEntities{
      {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}}};
  std::string plain;
  while (!text.empty()) {
    char c = text.front();
    std::size_t length = 1;
    for (const auto& [entity, meaning] : kEntities) {
      if (!text.starts_with(entity)) continue;
      c = meaning;
      length = entity.size();
    }
    plain += c;
    text.remove_prefix(length);
  }
  return plain;
}

/// "2026-11-22T10:20:30.000Z"
std::optional<std::int64_t> seconds_of(std::string_view text) {
  std::tm when{};
  const std::string copy(text.substr(0, 19));
  const char* end = ::strptime(copy.c_str(), "%Y-%m-%dT%H:%M:%S", &when);
  if (end == nullptr || *end != '\0') return std::nullopt;
  return std::int64_t{::timegm(&when)};
}

std::optional<S3Object> object_of(std::string_view xml) {
  const auto key = element(xml, "Key"), size = element(xml, "Size"), modified = element(xml, "LastModified");
  if (!key || !size || !modified) return std::nullopt;
  S3Object object;
  object.key = unescaped(*key);
  const auto [end, error] = std::from_chars(size->data(), size->data() + size->size(), object.bytes);
  const auto when = seconds_of(*modified);
  if (error != std::errc() || end != size->data() + size->size() || !when) return std::nullopt;
  object.modified_s = *when;
  return object;
}

}  // namespace

Result<S3Page> read_s3_list(std::string_view xml) {
  const auto unreadable = [] { return fault("blobs_refused", "the blob store sent a list that cannot be read"); };
  const auto truncated = element(xml, "IsTruncated");
  if (!truncated) return unreadable();
  S3Page page;
  for (std::string_view rest = xml;;) {
    const auto begin = rest.find("<Contents>");
    if (begin == std::string_view::npos) break;
    rest.remove_prefix(begin);
    const auto inside = element(rest, "Contents");
    const auto object = inside ? object_of(*inside) : std::nullopt;
    if (!object) return unreadable();
    page.objects.push_back(*object);
    rest.remove_prefix(inside->size() + std::string_view("<Contents></Contents>").size());
  }
  if (*truncated != "true") return page;
  const auto token = element(xml, "NextContinuationToken");
  if (!token || token->empty()) return unreadable();
  page.next_token = unescaped(*token);
  return page;
}

}  // namespace kiln
