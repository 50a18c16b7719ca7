#pragma once
// Lists of network addresses, and who stands behind a proxy that is among them.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace kiln {

/// Numeric IPv4 and IPv6 addresses, and networks like 10.0.0.0/8 or fd00::/8.
class AddressList {
 public:
  AddressList() = default;
  /// Fails  bad_address.
  static Result<AddressList> of(const std::vector<std::string>& texts);
  bool holds(const std::string& address) const;
  bool empty() const { return networks_.empty(); }

 private:
  struct Network {
    std::array<std::uint8_t, 16> bits{};  // IPv4 as ::ffff:a.b.c.d
    int length = 128;                     // leading bits that count
  };
  std::vector<Network> networks_;
};

/// The address of the client: that of the connection, unless that is a proxy of ours. Then the last address of
/// X-Forwarded-For that is not; what stands before it anybody may have written. A list that is malformed is not
/// believed.
std::string client_address(const std::string& peer, std::string_view forwarded_for, const AddressList& proxies);

}  // namespace kiln
