#pragma once
// HTTP to a Kiln server: requests out, replies or Failures back. The HTTP library stays inside.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_cli/commands.h"
#include "client_cli/failure.h"

namespace kiln {

using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

struct HttpReply {
  int status = 0;
  std::string body;
  std::string location;
  std::uint64_t upload_offset = 0;  // bytes of an unfinished upload that the server has
  bool upload_stored = false;       // they have become an asset
};

/// A request body in pieces that stay where they are; the sum of them is sent.
struct HttpBody {
  std::string media_type;
  std::vector<std::string_view> pieces;
};

/// Receives bytes of a reply as they come; false ends the transfer.
using ByteSink = std::function<bool(std::string_view)>;

/// Statuses of 400 and more are Failures made from the server's problem document. 429 and 503 are tried again after the
/// time that the server names, for some minutes. Fails  unreachable, interrupted, and what failure_of(Problem) gives
class ServerLink {
 public:
  /// `session.common.server` is http://host[:port][/prefix] or https://. Fails  usage
  static Outcome<ServerLink> open(Session& session);
  ~ServerLink();
  ServerLink(ServerLink&&) noexcept;

  Outcome<HttpReply> get(const std::string& path);
  /// What HEAD tells, whatever its status.
  Outcome<HttpReply> head(const std::string& path, const HttpHeaders& = {});
  Outcome<HttpReply> remove(const std::string& path);
  Outcome<HttpReply> post(const std::string& path, const HttpHeaders&, const HttpBody&);
  Outcome<HttpReply> put(const std::string& path, const HttpHeaders&, const HttpBody&);
  Outcome<HttpReply> patch(const std::string& path, const HttpHeaders&, const HttpBody&);
  /// A reply that is too long to keep, or never ends. Ends without failure when `sink` ends it.
  Outcome<void> stream(const std::string& path, const HttpHeaders&, const ByteSink& sink);

  /// The address as the user gave it, without a slash at its end.
  const std::string& url() const;
  Session& session() const;

 private:
  struct Connection;
  explicit ServerLink(std::unique_ptr<Connection>);
  std::unique_ptr<Connection> connection_;
};

/// Sleeps, but not through Ctrl-C. False when it was interrupted.
bool sleep_unless_interrupted(double seconds, const Interrupt&);

tl::unexpected<Failure> interrupted();

}  // namespace kiln
