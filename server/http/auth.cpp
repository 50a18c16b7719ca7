#include "server/http/auth.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <sstream>

#include "core/base/base64.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

constexpr std::size_t kTokenLength = 43;
constexpr int kMostDays = 36500;
constexpr std::uint64_t kMostMegabytes = 1'000'000'000;

std::string hash_of(std::string_view text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

bool is_token_text(std::string_view text) {
  return text.size() == kTokenLength && std::all_of(text.begin(), text.end(), [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
         });
}

/// The same time for every pair of equal length.
bool equal_hashes(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

/// The token in an Authorization value; empty when there is none.
std::string token_in(std::string_view value) {
  if (value.starts_with("Bearer ")) return std::string(value.substr(7));
  if (!value.starts_with("Basic ")) return {};
  const auto bytes = base64_decode(value.substr(6));
  if (!bytes) return {};
  const std::string pair(bytes->begin(), bytes->end());
  const std::size_t colon = pair.find(':');
  return colon == std::string::npos ? std::string() : pair.substr(colon + 1);
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
  });
}

template <class T>
bool read_number(std::string_view text, T& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && number > 0;
}

bool read_scopes(std::string_view list, AccessToken& token) {
  token.read = token.submit = token.admin = false;
  while (true) {
    const std::size_t comma = list.find(',');
    const std::string_view scope = list.substr(0, comma);
    if (scope != "read" && scope != "submit" && scope != "admin") return false;
    (scope == "read" ? token.read : scope == "submit" ? token.submit : token.admin) = true;
    if (comma == std::string_view::npos) return true;
    list.remove_prefix(comma + 1);
  }
}

/// False for a word that means nothing.
bool read_word(std::string_view word, AccessToken& token, bool& scopes_given) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view name = word.substr(0, equals), value = word.substr(equals + 1);
  if (name == "jobs") return read_number(value, token.max_jobs);
  if (name == "uploads") return read_number(value, token.max_uploads);
  if (name == "rate") return read_number(value, token.rate);
  if (name == "daily_mb") {
    const bool read = read_number(value, token.max_daily_bytes) && token.max_daily_bytes <= kMostMegabytes;
    token.max_daily_bytes <<= 20;
    return read;
  }
  if (name == "keep_days") return read_number(value, token.keep_days) && token.keep_days <= kMostDays;
  if (name == "tenant") {
    token.tenant = value;
    return is_name(value);
  }
  scopes_given = true;
  return name == "scopes" && read_scopes(value, token);
}

std::optional<AccessToken> token_of_line(const std::string& line) {
  std::istringstream words(line);
  std::string word;
  words >> word;
  if (!is_token_text(word)) return std::nullopt;
  AccessToken token;
  token.hash = hash_of(word);
  bool scopes_given = false;
  while (words >> word) {
    if (!read_word(word, token, scopes_given)) return std::nullopt;
  }
  if (!scopes_given && !token.tenant.empty()) token.admin = false;
  const bool limited = token.max_jobs > 0 || token.max_daily_bytes > 0 || token.keep_days > 0;
  if (token.admin && (!token.tenant.empty() || limited)) return std::nullopt;  // it stands for nobody
  return token;
}

}  // namespace

Result<std::vector<AccessToken>> read_tokens(const std::string& file) {
  std::ifstream lines(file);
  if (!lines) return fault("bad_token_file", "the token file cannot be read");
  std::vector<AccessToken> tokens;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.starts_with('#')) continue;
    const auto token = token_of_line(line);
    if (!token) {
      return fault(
          "bad_token_file",
          "a line is a token of 43 characters of A-Z, a-z, 0-9, - and _, and after it tenant=, scopes=, jobs=, "
          "uploads=, rate=, daily_mb=, keep_days=",
          "line " + std::to_string(number));
    }
    const auto differs = [&](const AccessToken& other) {
      return other.tenant == token->tenant && other.keep_days * token->keep_days > 0 &&
             other.keep_days != token->keep_days;
    };
    if (std::ranges::any_of(tokens, differs)) {
      return fault("bad_token_file", "one tenant has two keep_days", "line " + std::to_string(number));
    }
    tokens.push_back(*token);
  }
  if (tokens.empty()) return fault("bad_token_file", "the token file holds no token");
  return tokens;
}

std::map<std::string, Millis> kept_by_tenant(const std::vector<AccessToken>& tokens) {
  std::map<std::string, Millis> kept;
  for (const AccessToken& token : tokens)
    if (token.keep_days > 0) kept[token.tenant] = std::chrono::hours(24 * token.keep_days);
  return kept;
}

std::optional<std::size_t> carried_token(const Head& head, const std::vector<AccessToken>& tokens) {
  if (count_fields(head, "authorization") != 1) return std::nullopt;
  const std::string text = token_in(field_of(head, "authorization"));
  if (!is_token_text(text)) return std::nullopt;
  const std::string hash = hash_of(text);
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (equal_hashes(hash, tokens[i].hash)) found = i;
  }
  return found;
}

}  // namespace kiln
