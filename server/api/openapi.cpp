#include <nlohmann/json.hpp>

#include "core/bake/bake.h"
#include "server/api/endpoints.h"
#include "server/api/openapi_components.h"

namespace kiln {
namespace {

using Json = nlohmann::ordered_json;

Json reference(const char* kind, std::string_view name) {
  return {{"$ref", "#/components/" + std::string(kind) + "/" + std::string(name)}};
}

Json content(const std::vector<std::pair<std::string_view, std::string_view>>& types) {
  Json object = Json::object();
  for (const auto& [media, schema] : types) object[std::string(media)]["schema"] = reference("schemas", schema);
  return object;
}

Json responses(const Endpoint& endpoint) {
  Json success = {{"description", endpoint.summary}};
  if (!endpoint.replies.empty()) success["content"] = content(endpoint.replies);
  Json all = {{std::to_string(endpoint.success), std::move(success)}};
  for (const int status : endpoint.refusals) all[std::to_string(status)] = reference("responses", "Problem");
  all["default"] = reference("responses", "Problem");
  return all;
}

Json operation(const Endpoint& endpoint) {
  Json object = {{"operationId", endpoint.operation}, {"summary", endpoint.summary}, {"tags", {endpoint.tag}}};
  for (const std::string_view name : endpoint.parameters) object["parameters"].push_back(reference("parameters", name));
  if (takes_body(endpoint)) object["requestBody"] = {{"required", true}, {"content", content(endpoint.bodies)}};
  object["responses"] = responses(endpoint);
  return object;
}

/// What receivers are sent (server/webhooks): Standard Webhooks.
Json webhook(std::string_view status) {
  Json post = {{"operationId", "job." + std::string(status)},
               {"summary", "A job ended: " + std::string(status) + ". Signed, and sent until it is answered"},
               {"tags", {"webhooks"}}};
  for (const char* name : {"webhookId", "webhookTimestamp", "webhookSignature"})
    post["parameters"].push_back(reference("parameters", name));
  post["requestBody"] = {{"required", true}, {"content", content({{"application/json", "WebhookMessage"}})}};
  post["responses"] = {{"2XX", {{"description", "Taken; it does not come again"}}},
                       {"410", {{"description", "Not wanted; it does not come again"}}},
                       {"default", {{"description", "It comes again, with the same id, for a day"}}}};
  return {{"post", std::move(post)}};
}

std::string lower(std::string_view method) {
  std::string text(method);
  for (char& c : text) c = static_cast<char>(c - 'A' + 'a');
  return text;
}

}  // namespace

std::vector<std::string> query_names(const Endpoint& endpoint) {
  static const Json all = Json::parse(openapi_components())["parameters"];
  std::vector<std::string> names;
  for (const std::string_view parameter : endpoint.parameters) {
    const Json& known = all.at(std::string(parameter));
    if (known.at("in") == "query") names.push_back(known.at("name"));
  }
  return names;
}

std::string openapi_json() {
  Json document = {
      {"openapi", "3.1.0"},
      {"info",
       {{"title", "Kiln"},
        {"version", kEngineVersion},
        {"summary", "Bakes light: a glTF and a recipe in, a glTF that carries its own light transport out."},
        {"license", {{"name", "Apache-2.0"}, {"identifier", "Apache-2.0"}}}}},
      {"servers", {{{"url", "/"}}}}};
  for (const Endpoint& endpoint : endpoints())
    document["paths"][std::string(endpoint.path)][lower(endpoint.method)] = operation(endpoint);
  for (const char* status : {"succeeded", "failed", "canceled"})
    document["webhooks"]["job." + std::string(status)] = webhook(status);
  document["components"] = Json::parse(openapi_components());
  document["components"]["securitySchemes"] = {{"bearer", {{"type", "http"}, {"scheme", "bearer"}}},
                                               {"basic", {{"type", "http"}, {"scheme", "basic"}}}};
  document["security"] = {Json::object(), {{"bearer", Json::array()}}, {{"basic", Json::array()}}};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace kiln
