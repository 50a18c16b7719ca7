#pragma once
// The HTTP face of a Service. main() makes one:
//
//   HttpServer server(options, *service);
//   auto port = server.bind();     // a fault: the address is taken
//   server.run();                  // until drain(), which a signal handler may call
//
// How many threads: each upload, event stream, long poll and download holds one, so each kind is capped and what is
// left over answers quick requests, whatever the others do.

#include <memory>
#include <string>
#include <vector>

#include "server/http/access_log.h"
#include "server/http/auth.h"
#include "server/http/front.h"
#include "server/work/service.h"

namespace kiln {

struct HttpOptions {
  std::string address = "127.0.0.1";
  int port = 8080;  // 0: any free one
  std::uint64_t max_upload_bytes = 8ull << 30;
  int max_uploads = 16;
  int max_streams = 48;  // event streams and long polls
  int max_downloads = 16;
  int quick_threads = 16;                       // beside those
  std::chrono::milliseconds heartbeat{10'000};  // longest silence of an event stream
  std::vector<std::string> hosts;    // names a Host field may have; empty: any. A local server should list its own
  std::vector<std::string> origins;  // of pages that may read and change; each passes is_origin (cors.h); empty: none
  AddressList proxies;               // whose X-Forwarded-For is believed
  std::vector<AccessToken> tokens;   // from read_tokens (auth.h); empty: nobody is asked
  LogLine log = log_to_stderr;       // one JSON line per request; empty: none
  FrontOptions front;                // address, port, threads and proxies are taken from above
};

/// Host names of a server that only this machine should reach: guards against DNS rebinding.
std::vector<std::string> loopback_hosts();

class HttpServer {
 public:
  /// The service must outlive the server.
  HttpServer(const HttpOptions& options, Service& service);
  ~HttpServer();
  /// The port. Fails  bind_failed.
  Result<int> bind();
  /// Serves until drain(); then streams end, requests under way finish, and it returns.
  void run();
  /// Safe from any thread and signal handler.
  void drain() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
