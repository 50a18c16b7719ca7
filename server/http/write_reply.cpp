#include "server/http/write_reply.h"

#include <algorithm>
#include <utility>

#include "server/http/front.h"

namespace kiln {
namespace {

constexpr std::pair<int, const char*> kReasons[] = {
    {200, "OK"},
    {201, "Created"},
    {202, "Accepted"},
    {204, "No Content"},
    {206, "Partial Content"},
    {304, "Not Modified"},
    {400, "Bad Request"},
    {401, "Unauthorized"},
    {403, "Forbidden"},
    {404, "Not Found"},
    {405, "Method Not Allowed"},
    {408, "Request Timeout"},
    {409, "Conflict"},
    {411, "Length Required"},
    {413, "Content Too Large"},
    {414, "URI Too Long"},
    {415, "Unsupported Media Type"},
    {416, "Range Not Satisfiable"},
    {417, "Expectation Failed"},
    {421, "Misdirected Request"},
    {422, "Unprocessable Content"},
    {429, "Too Many Requests"},
    {431, "Request Header Fields Too Large"},
    {500, "Internal Server Error"},
    {503, "Service Unavailable"},
    {505, "HTTP Version Not Supported"},
    {507, "Insufficient Storage"},
};

/// What every reply carries unless its route says otherwise (reliability.md S7).
constexpr std::pair<const char*, const char*> kEverywhere[] = {
    {"x-content-type-options", "nosniff"},
    {"referrer-policy", "no-referrer"},
    {"cross-origin-resource-policy", "same-origin"},
    {"content-security-policy", "default-src 'none'; frame-ancestors 'none'"},
};

const char* reason_of(int status) {
  for (const auto& [known, reason] : kReasons)
    if (known == status) return reason;
  return "Unknown";
}

bool has_field(const Reply& reply, std::string_view name) {
  return std::any_of(reply.fields.begin(), reply.fields.end(), [&](const Field& field) { return field.name == name; });
}

bool has_no_body(int status) { return status == 204 || status == 304; }

}  // namespace

std::string reply_head(const Reply& reply, const std::string& request_id) {
  std::string head = "HTTP/1.1 " + std::to_string(reply.status) + " " + reason_of(reply.status) + "\r\n";
  const auto add = [&head](std::string_view name, std::string_view value) {
    head.append(name).append(": ").append(value).append("\r\n");
  };
  for (const Field& field : reply.fields) add(field.name, field.value);
  for (const auto& [name, value] : kEverywhere)
    if (!has_field(reply, name)) add(name, value);
  if (!request_id.empty()) add("x-request-id", request_id);
  const bool sized = !reply.stream || reply.stream_length.has_value();
  const std::uint64_t length = reply.stream ? reply.stream_length.value_or(0) : reply.body.size();
  if (sized && !has_no_body(reply.status)) add("content-length", std::to_string(length));
  add("connection", "close");
  return head + "\r\n";
}

bool write_reply(Sink& sink, const Reply& reply, const std::string& request_id, bool head_only) {
  const std::string head = reply_head(reply, request_id);
  const bool bodyless = head_only || has_no_body(reply.status);
  if (bodyless || reply.stream) {
    if (!sink.write(head)) return false;
    if (!bodyless) reply.stream(sink);
    return true;
  }
  return sink.write(head + reply.body);  // one packet for small replies
}

std::string bare_refusal(int status, const Problem& problem) {
  Reply reply = problem_reply(problem);
  reply.status = status;
  return reply_head(reply, {}) + reply.body;
}

}  // namespace kiln
