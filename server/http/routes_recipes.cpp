#include <nlohmann/json.hpp>

#include "core/bake/recipe.h"
#include "server/http/reply_of.h"
#include "server/http/routes.h"
#include "server/http/upload.h"

namespace kiln {
namespace {

using nlohmann::json;

Reply plan_job(RouteContext&, Request& request) {
  auto submission = read_submission(request, *request.service);
  if (!submission) return problem_reply(submission.error());
  auto plan = request.service->plan(*submission);
  return plan ? json_reply(200, std::move(*plan)) : fault_reply(plan.error());
}

Reply list_presets(Request&) {
  json list = json::array();
  for (const Preset& preset : presets())
    list.push_back(
        {{"name", preset.name}, {"description", preset.description}, {"recipe", json::parse(preset.recipe)}});
  return json_reply(200, json{{"presets", std::move(list)}}.dump());
}

Reply schema(Request&) {
  Reply reply = json_reply(200, recipe_schema());
  reply.fields.front().value = "application/schema+json";
  return reply;
}

}  // namespace

Handlers recipe_routes(RouteContext& context) {
  return {{"planJob", [&context](Request& request) { return plan_job(context, request); }},
          {"listPresets", list_presets},
          {"recipeSchema", schema}};
}

}  // namespace kiln
