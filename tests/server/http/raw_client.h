#pragma once
// A client that sends exactly the bytes it is told to, and a server in this process to send them to.

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/http/http_server.h"
#include "tests/server/http/fake_service.h"

namespace kiln {

struct RawReply {
  int status = 0;  // 0: no reply at all
  std::string head;
  std::map<std::string, std::string> fields;  // lower-case names; the last of each
  std::string body;
  std::string all;     // everything that came until the end of the connection
  bool ended = false;  // the server closed within the time
};

class RawConnection {
 public:
  explicit RawConnection(int port);
  ~RawConnection();
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;
  bool send(std::string_view bytes);
  /// Reads until `text` has come or the time is over; everything so far.
  const std::string& read_until(const std::string& text, std::chrono::milliseconds limit = std::chrono::seconds(10));
  RawReply read_reply(std::chrono::milliseconds limit = std::chrono::seconds(20));
  void shut();

 private:
  bool read_some(std::chrono::steady_clock::time_point end);
  int fd_ = -1;
  std::string received_;
};

RawReply parse_reply(const std::string& bytes);

/// "GET /x HTTP/1.1" with Host and the given further lines.
std::string request_text(const std::string& method, const std::string& target,
                         const std::vector<std::string>& lines = {}, const std::string& body = {});

/// Options of a small server: what is tested does not depend on the number of threads, how long it takes does.
HttpOptions few_threads();

class RunningServer {
 public:
  explicit RunningServer(HttpOptions options = few_threads());
  ~RunningServer();
  int port() const { return port_; }
  FakeService& service() { return service_; }
  RawReply raw(const std::string& bytes) const;
  RawReply get(const std::string& target, const std::vector<std::string>& lines = {}) const;
  RawReply post(const std::string& target, const std::string& type, const std::string& body) const;
  /// A queued job's id.
  std::string make_job(const std::string& label = {});
  std::vector<std::string> log();
  void drain() { server_->drain(); }

 private:
  FakeService service_;
  std::mutex log_mutex_;
  std::vector<std::string> log_;
  std::unique_ptr<HttpServer> server_;
  int port_ = 0;
  std::thread thread_;
};

inline const std::string kSha(64, 'a');

}  // namespace kiln
