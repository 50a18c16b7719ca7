#pragma once
// Which addresses belong to the public Internet, so that a name cannot lead a server into its own network.

struct sockaddr;

namespace kiln {

/// False for loopback, private, shared, link-local, documentation, benchmark, multicast and reserved addresses (the
/// registries of RFC 6890), for IPv6 that holds such an IPv4 address (mapped, NAT64, 6to4), and for other families.
bool is_public_address(const sockaddr&);

}  // namespace kiln
