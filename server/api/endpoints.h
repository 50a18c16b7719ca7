#pragma once
// Every endpoint, said once: the router, the OpenAPI document and the answer to a wrong method are made from this
// table.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

struct Endpoint {
  std::string_view method;     // GET also answers HEAD
  std::string_view path;       // "/v1/jobs/{id}"
  std::string_view operation;  // unique; the handler's name
  std::string_view tag;        // jobs, artifacts, assets, uploads, recipes, service, viewer
  std::string_view summary;
  std::vector<std::string_view> parameters;                           // names in components/parameters
  std::vector<std::pair<std::string_view, std::string_view>> bodies;  // media type, schema
  int success = 200;
  std::vector<std::pair<std::string_view, std::string_view>> replies;  // media type, schema of the success
  std::vector<int> refusals;                                           // statuses with problem+json
};

const std::vector<Endpoint>& endpoints();

/// Takes a request body.
bool takes_body(const Endpoint&);

/// The parameters of its query.
std::vector<std::string> query_names(const Endpoint&);

/// The OpenAPI 3.1 document of endpoints().
std::string openapi_json();

}  // namespace kiln
