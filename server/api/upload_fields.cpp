#include "server/api/upload_fields.h"

#include <array>
#include <ctime>
#include <set>

#include "core/base/base64.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxPairs = 16;

bool is_key(std::string_view text) {
  for (const char c : text)
    if (c <= ' ' || c > '~') return false;
  return !text.empty() && text.size() <= 64;
}

bool is_hash(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

tl::unexpected<Problem> bad_metadata() {
  return refuse("bad_header", "Upload-Metadata must read: name base64,name base64; each name once, at most " +
                                  std::to_string(kMaxPairs) + " of them in " + std::to_string(kMaxUploadMetadata) +
                                  " bytes");
}

}  // namespace

Answer<UploadMetadata> parse_upload_metadata(std::string_view text) {
  UploadMetadata metadata{std::string(text), {}};
  std::set<std::string_view> names;
  if (text.size() > kMaxUploadMetadata) return bad_metadata();
  while (!text.empty()) {
    std::string_view pair = text.substr(0, text.find(','));
    text.remove_prefix(std::min(pair.size() + 1, text.size()));
    while (pair.starts_with(' ')) pair.remove_prefix(1);
    const std::string_view name = pair.substr(0, pair.find(' '));
    const auto value = base64_decode(pair.substr(std::min(name.size() + 1, pair.size())));
    if (!is_key(name) || !value || !names.insert(name).second || names.size() > kMaxPairs) return bad_metadata();
    if (name != "sha256") continue;
    metadata.sha256.assign(value->begin(), value->end());
    if (!is_hash(metadata.sha256)) {
      return refuse("bad_header", "sha256 in Upload-Metadata must be 64 lower-case hex digits, in base64");
    }
  }
  return metadata;
}

Answer<std::optional<UploadChecksum>> parse_upload_checksum(std::string_view text) {
  if (text.empty()) return std::optional<UploadChecksum>();
  const std::string_view name = text.substr(0, text.find(' '));
  const auto digest = base64_decode(text.substr(std::min(name.size() + 1, text.size())));
  UploadChecksum checksum{name == "sha1" ? DigestKind::sha1 : DigestKind::sha256,
                          digest.value_or(std::vector<std::uint8_t>())};
  const std::size_t bytes = name == "sha1" ? 20 : name == "sha256" ? 32 : 0;
  if (bytes == 0 || checksum.digest.size() != bytes) {
    return refuse("bad_header", "Upload-Checksum must read: sha256 BASE64 or sha1 BASE64");
  }
  return std::optional(std::move(checksum));
}

std::string http_date(std::int64_t unix_s) {
  const std::time_t time = unix_s;
  std::tm utc{};
  gmtime_r(&time, &utc);
  constexpr const char* kDays[] = {"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
  constexpr const char* kMonths[] = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                     "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%s, %02d %s %d %02d:%02d:%02d GMT", kDays[utc.tm_wday], utc.tm_mday,
                kMonths[utc.tm_mon], utc.tm_year + 1900, utc.tm_hour, utc.tm_min, utc.tm_sec);
  return text.data();
}

}  // namespace kiln
