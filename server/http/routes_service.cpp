#include <nlohmann/json.hpp>

#include "core/bake/bake.h"
#include "server/api/endpoints.h"
#include "server/http/reply_of.h"
#include "server/http/routes.h"

namespace kiln {
namespace {

using nlohmann::json;

Reply health(Request&) { return json_reply(200, R"({"status":"ok"})"); }

Reply readiness(RouteContext& context) {
  std::vector<std::string> reasons;
  json checks = json::object();
  for (const Check& check : context.service.checks()) {
    checks[check.name] = check.state;
    if (!check.ready) reasons.push_back(check.state);
  }
  if (context.draining) reasons.emplace_back("the server is shutting down");
  const bool ready = reasons.empty();
  Reply reply = json_reply(
      ready ? 200 : 503, json{{"ready", ready}, {"reasons", std::move(reasons)}, {"checks", std::move(checks)}}.dump());
  if (!ready) reply.fields.push_back({"retry-after", "5"});
  return reply;
}

Reply metrics(RouteContext& context) {
  Reply reply = json_reply(200, context.metrics_text());
  reply.fields.front().value = "text/plain; version=0.0.4; charset=utf-8";
  return reply;
}

Reply version(Request&) { return json_reply(200, json{{"engine", kEngineVersion}, {"api", "v1"}}.dump()); }

}  // namespace

Handlers service_routes(RouteContext& context) {
  return {{"health", health},
          {"readiness", [&context](Request&) { return readiness(context); }},
          {"metrics", [&context](Request&) { return metrics(context); }},
          {"version", version},
          {"openapi", [](Request&) { return json_reply(200, openapi_json()); }}};
}

}  // namespace kiln
