#include "server/http/addresses.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>

namespace kiln {
namespace {

using Bits = std::array<std::uint8_t, 16>;

std::optional<Bits> bits_of(const std::string& text) {
  Bits bits{};
  in_addr v4{};
  if (inet_pton(AF_INET, text.c_str(), &v4) == 1) {
    bits[10] = bits[11] = 0xff;
    std::memcpy(bits.data() + 12, &v4, 4);
    return bits;
  }
  if (inet_pton(AF_INET6, text.c_str(), bits.data()) == 1) return bits;
  return std::nullopt;
}

bool same_start(const Bits& a, const Bits& b, int length) {
  for (int bit = 0; bit < length; ++bit) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    if (((a[byte] ^ b[byte]) >> (7 - bit % 8) & 1) != 0) return false;
  }
  return true;
}

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

}  // namespace

Result<AddressList> AddressList::of(const std::vector<std::string>& texts) {
  AddressList list;
  for (const std::string& text : texts) {
    const std::size_t slash = text.find('/');
    const auto bits = bits_of(text.substr(0, slash));
    const bool v4 = text.find(':') == std::string::npos;
    int length = v4 ? 32 : 128;
    if (bits && slash != std::string::npos) {
      const char* end = text.data() + text.size();
      const int most = length;
      const auto [stop, error] = std::from_chars(text.data() + slash + 1, end, length);
      if (error != std::errc() || stop != end || length < 0 || length > most) length = -1;
    }
    if (!bits || length < 0) {
      return fault("bad_address", "'" + text + "' is no numeric address and no network like 10.0.0.0/8");
    }
    list.networks_.push_back({*bits, v4 ? 96 + length : length});
  }
  return list;
}

bool AddressList::holds(const std::string& address) const {
  const auto bits = bits_of(address);
  return bits && std::ranges::any_of(networks_, [&](const Network& network) {
           return same_start(*bits, network.bits, network.length);
         });
}

std::string client_address(const std::string& peer, std::string_view forwarded_for, const AddressList& proxies) {
  std::string client = peer;
  while (proxies.holds(client) && !forwarded_for.empty()) {
    const std::size_t comma = forwarded_for.rfind(',');
    const std::string before(
        trimmed(comma == std::string_view::npos ? forwarded_for : forwarded_for.substr(comma + 1)));
    if (!bits_of(before)) break;
    client = before;
    forwarded_for = comma == std::string_view::npos ? std::string_view() : forwarded_for.substr(0, comma);
  }
  return client;
}

}  // namespace kiln
