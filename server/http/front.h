#pragma once
// The front of the server: one epoll thread accepts, reads request heads and lingers; worker threads serve whole heads.
//
// A slow or silent client costs a descriptor and a few kilobytes, never a thread: its head must be complete within
// `head_deadline`. Connections are capped in total (the one that has waited longest for its head makes room) and per
// address, the queue to the workers is bounded (503 at once when full), and accept() survives every error.
// One request per connection. After its reply the client's unread bytes are discarded for a while, so that it sees a
// reply that came before the end of its upload.

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "server/http/addresses.h"
#include "server/http/connection.h"

namespace kiln {

struct FrontOptions {
  std::string address = "127.0.0.1";  // numeric IPv4 or IPv6
  int port = 8080;                    // 0: any free one
  int threads = 96;
  int backlog = 1024;
  std::size_t max_connections = 4096;
  std::size_t max_per_address = 1024;  // not counted for loopback and for these
  AddressList proxies;                 // reverse proxies: many clients come from one address
  std::size_t max_queued = 1024;       // complete heads that wait for a worker
  std::size_t head_bytes = 32u << 10;
  std::chrono::milliseconds head_deadline{5000};
  std::chrono::milliseconds linger{2000};
  std::chrono::milliseconds drain_grace{10'000};  // then connections are cut
  Pace pace;
};

struct FrontStats {
  std::size_t connections = 0, serving = 0, queued = 0;
  std::uint64_t accepted = 0, head_timeouts = 0, evicted = 0, over_address_cap = 0, queue_full = 0, head_too_large = 0,
                accept_errors = 0;
};

/// What a worker does with a complete head. Returns true when the request was read to its end.
using ServeHead = std::function<bool(Connection&, std::string_view head, const std::string& peer)>;
/// The reply to a connection that never reaches a worker.
using RefusalText = std::function<std::string(const Problem&)>;

class Front {
 public:
  Front(FrontOptions options, ServeHead serve, RefusalText refusal);
  ~Front();
  /// Binds and listens; the port. Fails  bind_failed: the address is in use or not ours.
  Result<int> bind();
  /// Serves until drain(). Returns when every worker has ended.
  void run();
  /// Stops accepting and ends run() when the requests under way are done. Safe from any thread and signal handler.
  void drain() noexcept;
  FrontStats stats() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
