#pragma once
// cpp-httplib behind our front: it reads the request line, finds the route, runs the handler and writes the reply.
//
// It is shown the method and the path of a checked head, and nothing else. Version 0.11.4 acts on the rest before a
// hook of ours can stop it, and wrongly (reliability.md 3.1): it decodes escapes in every field, parses Range by a
// recursive regex, compresses for whoever offers gzip, takes REMOTE_ADDR from the client, and believes bodies that are
// chunked, compressed or have no length. So fields are read by parse_head.h, and bodies through BodySource.

#include <functional>
#include <memory>
#include <string>

#include "server/api/endpoints.h"
#include "server/http/message.h"

namespace kiln {

/// Answers a request whose route is found. `endpoint` is null when none has that path and method: `handler` says so.
using Answerer = std::function<Reply(const Endpoint* endpoint, const Handler& handler, Request&)>;

/// What came of a request.
struct Outcome {
  int status = 0;                  // 0: no reply could be made
  std::string operation = "none";  // of the endpoint
  std::string fault;               // what an exception said, for the log
};

class HttplibServer {
 public:
  /// Every endpoint must have a handler and every handler an endpoint; `elsewhere` answers what has no endpoint.
  HttplibServer(const Handlers& handlers, const Handler& elsewhere, Answerer answer);
  ~HttplibServer();

  /// Routes and answers one request, from any thread. Its reply goes to request.client.
  Outcome serve(Request&) const;
  /// Replies with a problem to what never became a request.
  Outcome refuse(const Problem&, Sink& client) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
