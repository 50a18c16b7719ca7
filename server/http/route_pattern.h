#pragma once
// The paths of server/api/endpoints.h as patterns, and what their addresses say to a method that they do not take.

#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"

namespace kiln {

/// "/v1/jobs/([^/]+)" of "/v1/jobs/{id}", and the names in braces. The simplest regex that does: std::regex recurses.
struct RoutePattern {
  std::string regex;
  std::vector<std::string> names;
};
RoutePattern pattern_of(std::string_view path);

/// "POST, GET, HEAD": the methods of a path of the table, in its order.
std::string allowed_methods(std::string_view path);

/// 405, and 204 for OPTIONS.
Handler method_not_allowed(const std::string& allow);
Handler list_methods(const std::string& allow);

}  // namespace kiln
