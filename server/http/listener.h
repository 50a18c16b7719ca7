#pragma once
// The listening socket.

#include <string>

#include "core/base/result.h"

namespace kiln {

struct Listener {
  int fd = -1;
  int port = 0;
};

/// Binds a numeric address with SO_REUSEADDR only (never SO_REUSEPORT: a second server must fail), non-blocking.
/// Fails  bind_failed.
Result<Listener> open_listener(const std::string& address, int port, int backlog);

/// An accepted connection's peer; `loopback` when it is this machine.
struct Peer {
  std::string address;
  bool loopback = false;
};

/// The next waiting connection, non-blocking and close-on-exec; -1 and errno when there is none.
int accept_connection(int listener, Peer& peer);

}  // namespace kiln
