#pragma once
// Which handler answers a method and a path: the table of server/api/endpoints.h joined with the handlers.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/api/endpoints.h"
#include "server/http/message.h"

namespace kiln {

using Handler = std::function<Reply(Request&)>;
/// By operation name.
using Handlers = std::map<std::string, Handler, std::less<>>;

struct RouteMatch {
  const Endpoint* endpoint = nullptr;  // null: no such path, or not with this method
  const Handler* handler = nullptr;
  std::vector<std::pair<std::string, std::string>> params;
  std::string allow;  // methods of the path; empty: no such path
};

class Router {
 public:
  /// Every endpoint must have a handler and every handler an endpoint.
  explicit Router(Handlers handlers);
  RouteMatch match(std::string_view method, std::string_view path) const;

 private:
  Handlers handlers_;
};

}  // namespace kiln
