#include "server/http/route_pattern.h"

#include "server/api/endpoints.h"

namespace kiln {

RoutePattern pattern_of(std::string_view path) {
  RoutePattern pattern;
  while (!path.empty()) {
    const bool is_name = path.front() == '{';
    const std::size_t end = is_name ? path.find('}') + 1 : 1;
    if (is_name) pattern.names.emplace_back(path.substr(1, end - 2));
    pattern.regex += is_name ? "([^/]+)" : path.front() == '.' ? "\\." : std::string(path.substr(0, 1));
    path.remove_prefix(end);
  }
  return pattern;
}

std::string allowed_methods(std::string_view path) {
  std::string list;
  for (const Endpoint& endpoint : endpoints()) {
    if (endpoint.path != path) continue;
    if (!list.empty()) list += ", ";
    list += endpoint.method == "GET" ? "GET, HEAD" : std::string(endpoint.method);
  }
  return list;
}

Handler method_not_allowed(const std::string& allow) {
  return [allow](Request&) {
    Reply reply = problem_reply(make_problem("method_not_allowed", "this address takes " + allow));
    reply.fields.push_back({"allow", allow});
    return reply;
  };
}

Handler list_methods(const std::string& allow) {
  return [allow](Request&) {
    Reply reply;
    reply.status = 204;
    reply.fields.push_back({"allow", allow + ", OPTIONS"});
    return reply;
  };
}

}  // namespace kiln
