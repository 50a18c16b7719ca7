#include "server/http/message.h"

#include <algorithm>
#include <cctype>
#include <ctime>

#include "core/base/expects.h"

namespace kiln {

std::string_view field_of(const Head& head, std::string_view name) {
  for (const Field& field : head.fields)
    if (field.name == name) return field.value;
  return {};
}

std::size_t count_fields(const Head& head, std::string_view name) {
  return static_cast<std::size_t>(
      std::count_if(head.fields.begin(), head.fields.end(), [&](const Field& field) { return field.name == name; }));
}

std::string media_type_of(const Head& head) {
  std::string_view value = field_of(head, "content-type");
  value = value.substr(0, value.find(';'));
  while (value.ends_with(' ')) value.remove_suffix(1);
  std::string type(value);
  std::transform(type.begin(), type.end(), type.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return type;
}

Answer<std::string> read_all(BodySource& body, std::uint64_t limit) {
  if (body.length() > limit) return refuse("too_large", "this body may have " + std::to_string(limit) + " bytes");
  std::string text(body.length(), '\0');
  std::size_t filled = 0;
  while (filled < text.size()) {
    auto got = body.read({reinterpret_cast<std::uint8_t*>(text.data()) + filled, text.size() - filled});
    if (!got) return tl::make_unexpected(got.error());
    filled += *got;
  }
  return text;
}

Reply json_reply(int status, std::string json) {
  Reply reply;
  reply.status = status;
  reply.fields.push_back({"content-type", "application/json"});
  reply.fields.push_back({"cache-control", "no-store"});
  reply.body = std::move(json);
  return reply;
}

namespace {

/// Seconds until a client that was told so may try again.
std::int64_t retry_after(const Problem& problem) {
  if (problem.code != "daily_quota") return problem.status == 507 ? 60 : 2;
  constexpr std::int64_t kDay = 24 * 3600;
  return kDay - std::time(nullptr) % kDay;
}

}  // namespace

Reply problem_reply(const Problem& problem) {
  Reply reply;
  reply.status = problem.status;
  reply.fields.push_back({"content-type", kProblemType});
  reply.fields.push_back({"cache-control", "no-store"});
  if (problem.status == 429 || problem.status == 503 || problem.status == 507)
    reply.fields.push_back({"retry-after", std::to_string(retry_after(problem))});
  if (problem.status == 401) {  // a browser asks its user for the second
    reply.fields.push_back({"www-authenticate", "Bearer realm=\"kiln\""});
    reply.fields.push_back({"www-authenticate", "Basic realm=\"kiln\", charset=\"UTF-8\""});
  }
  reply.body = problem_json(problem);
  return reply;
}

const std::string& path_param(const Request& request, std::string_view name) {
  const auto found = std::find_if(request.path_params.begin(), request.path_params.end(),
                                  [&](const auto& param) { return param.first == name; });
  EXPECTS(found != request.path_params.end());
  return found->second;
}

}  // namespace kiln
