#include "server/http/auth.h"

#include <algorithm>
#include <cctype>
#include <fstream>

#include "core/base/sha256.h"

namespace kiln {
namespace {

constexpr std::size_t kTokenLength = 43;

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

int base64_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

std::string base64_decode(std::string_view text) {
  std::string bytes;
  unsigned buffer = 0;
  int bits = 0;
  for (const char c : text) {
    const int value = base64_value(c);
    if (value < 0) break;
    buffer = (buffer << 6 | static_cast<unsigned>(value)) & 0xffffffU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<char>(buffer >> bits & 0xffU));
  }
  return bytes;
}

/// The token in an Authorization value; empty when there is none.
std::string token_in(std::string_view value) {
  if (value.starts_with("Bearer ")) return std::string(value.substr(7));
  if (!value.starts_with("Basic ")) return {};
  const std::string pair = base64_decode(value.substr(6));
  const std::size_t colon = pair.find(':');
  return colon == std::string::npos ? std::string() : pair.substr(colon + 1);
}

}  // namespace

Result<std::vector<std::string>> read_token_hashes(const std::string& file) {
  std::ifstream lines(file);
  if (!lines) return fault("bad_token_file", "the token file cannot be read");
  std::vector<std::string> hashes;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.starts_with('#')) continue;
    if (!is_token_text(line))
      return fault("bad_token_file", "a token has 43 characters of A-Z, a-z, 0-9, - and _",
                   "line " + std::to_string(number));
    hashes.push_back(hash_of(line));
  }
  if (hashes.empty()) return fault("bad_token_file", "the token file holds no token");
  return hashes;
}

bool carries_token(const Head& head, const std::vector<std::string>& hashes) {
  if (count_fields(head, "authorization") != 1) return false;
  const std::string token = token_in(field_of(head, "authorization"));
  const std::string hash = hash_of(token);
  bool found = false;
  for (const std::string& known : hashes) found = equal_hashes(hash, known) || found;
  return found && is_token_text(token);
}

}  // namespace kiln
