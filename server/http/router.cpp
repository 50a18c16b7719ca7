#include "server/http/router.h"

#include <algorithm>

#include "core/base/expects.h"

namespace kiln {
namespace {

using Params = std::vector<std::pair<std::string, std::string>>;

std::string_view take_segment(std::string_view& path) {
  const std::size_t end = std::min(path.find('/', 1), path.size());
  const std::string_view segment = path.substr(1, end - 1);
  path.remove_prefix(end);
  return segment;
}

bool match_path(std::string_view pattern, std::string_view path, Params& params) {
  params.clear();
  while (!pattern.empty() && !path.empty()) {
    const std::string_view expected = take_segment(pattern);
    const std::string_view given = take_segment(path);
    if (!expected.starts_with('{')) {
      if (expected != given) return false;
    } else {
      if (given.empty()) return false;
      params.emplace_back(expected.substr(1, expected.size() - 2), given);
    }
  }
  return pattern.empty() && path.empty();
}

bool answers(const Endpoint& endpoint, std::string_view method) {
  return endpoint.method == method || (endpoint.method == "GET" && method == "HEAD");
}

}  // namespace

Router::Router(Handlers handlers) : handlers_(std::move(handlers)) {
  EXPECTS(handlers_.size() == endpoints().size());
  for (const Endpoint& endpoint : endpoints()) EXPECTS(handlers_.contains(endpoint.operation));
}

RouteMatch Router::match(std::string_view method, std::string_view path) const {
  RouteMatch match;
  Params params;
  for (const Endpoint& endpoint : endpoints()) {
    if (!match_path(endpoint.path, path, params)) continue;
    if (answers(endpoint, method)) {
      match.endpoint = &endpoint;
      match.handler = &handlers_.find(endpoint.operation)->second;
      match.params = params;
    }
    if (!match.allow.empty()) match.allow += ", ";
    match.allow += endpoint.method == "GET" ? "GET, HEAD" : std::string(endpoint.method);
  }
  return match;
}

}  // namespace kiln
