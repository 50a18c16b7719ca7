#include "server/webhooks/address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace kiln {
namespace {

struct Block4 {
  std::uint32_t first;
  int bits;
};

constexpr std::uint32_t ip4(std::uint32_t a, std::uint32_t b, std::uint32_t c = 0) {
  return a << 24 | b << 16 | c << 8;
}

constexpr std::array kNotPublic4{
    Block4{ip4(0, 0), 8},          // this network
    Block4{ip4(10, 0), 8},         // private
    Block4{ip4(100, 64), 10},      // shared by customers of a carrier
    Block4{ip4(127, 0), 8},        // loopback
    Block4{ip4(169, 254), 16},     // link-local, and the metadata of clouds
    Block4{ip4(172, 16), 12},      // private
    Block4{ip4(192, 0, 0), 24},    // protocols
    Block4{ip4(192, 0, 2), 24},    // documentation
    Block4{ip4(192, 88, 99), 24},  // relays of 6to4
    Block4{ip4(192, 168), 16},     // private
    Block4{ip4(198, 18), 15},      // benchmarks
    Block4{ip4(198, 51, 100), 24}, Block4{ip4(203, 0, 113), 24}, Block4{ip4(224, 0), 4},  // multicast
    Block4{ip4(240, 0), 4},                                                               // reserved, broadcast
};

bool is_public4(std::uint32_t address) {
  return std::ranges::none_of(kNotPublic4,
                              [&](const Block4& block) { return (address ^ block.first) >> (32 - block.bits) == 0; });
}

using Bytes16 = std::array<std::uint8_t, 16>;

bool starts_with(const Bytes16& address, const Bytes16& prefix, std::size_t bytes) {
  return std::equal(prefix.begin(), prefix.begin() + static_cast<std::ptrdiff_t>(bytes), address.begin());
}

std::uint32_t ip4_at(const Bytes16& address, std::size_t at) {
  return std::uint32_t{address[at]} << 24 | std::uint32_t{address[at + 1]} << 16 | std::uint32_t{address[at + 2]} << 8 |
         address[at + 3];
}

bool is_public6(const Bytes16& address) {
  if (starts_with(address, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF}, 12)) return is_public4(ip4_at(address, 12));
  if (starts_with(address, {0x00, 0x64, 0xFF, 0x9B}, 12)) return is_public4(ip4_at(address, 12));  // NAT64
  if (starts_with(address, {0x20, 0x02}, 2)) return is_public4(ip4_at(address, 2));                // 6to4
  if (starts_with(address, {0x20, 0x01, 0x0D, 0xB8}, 4)) return false;                             // documentation
  if (starts_with(address, {0x3F, 0xFF}, 2) && address[2] < 0x10) return false;                    // documentation, too
  if (starts_with(address, {0x20, 0x01, 0x00}, 3) && address[3] < 2) return false;  // Teredo and protocols
  return (address[0] & 0xE0) == 0x20;                                               // 2000::/3 is all there is
}

}  // namespace

bool is_public_address(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    sockaddr_in four{};
    std::memcpy(&four, &address, sizeof four);
    return is_public4(ntohl(four.sin_addr.s_addr));
  }
  if (address.sa_family == AF_INET6) {
    sockaddr_in6 six{};
    std::memcpy(&six, &address, sizeof six);
    Bytes16 bytes{};
    std::memcpy(bytes.data(), &six.sin6_addr, bytes.size());
    return is_public6(bytes);
  }
  return false;
}

}  // namespace kiln
