#include "server/http/exchange.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>

#include "server/http/auth.h"
#include "server/http/parse_head.h"
#include "server/http/write_reply.h"

namespace kiln {
namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

bool changes_something(const Head& head) {
  return head.method != "GET" && head.method != "HEAD" && head.method != "OPTIONS";
}

/// "example.org" of "example.org:8080", "[::1]" of "[::1]:8080".
std::string_view host_name(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  const std::size_t bracket = host.rfind(']');
  const bool has_port = colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket);
  return has_port ? host.substr(0, colon) : host;
}

std::string_view without_scheme(std::string_view origin) {
  const std::size_t at = origin.find("://");
  return at == std::string_view::npos ? std::string_view() : origin.substr(at + 3);
}

/// What probes ask without a token: whether we live, and which version.
bool is_open_to_all(const RouteMatch& match) {
  if (match.endpoint == nullptr) return false;
  const std::string_view name = match.endpoint->operation;
  return name == "health" || name == "readiness" || name == "version";
}

Reply not_found() { return problem_reply(make_problem("not_found", "there is nothing at this address")); }

Reply method_not_allowed(const RouteMatch& match) {
  Reply reply = problem_reply(make_problem("method_not_allowed", "this address takes " + match.allow));
  reply.fields.push_back({"allow", match.allow});
  return reply;
}

Reply options_reply(const RouteMatch& match) {
  Reply reply;
  reply.status = 204;
  reply.fields.push_back({"allow", match.allow + ", OPTIONS"});
  return reply;
}

/// Puts the request id into a problem that a handler made without knowing it.
void stamp(Reply& reply, const std::string& id) {
  const bool is_problem = std::any_of(reply.fields.begin(), reply.fields.end(), [](const Field& field) {
    return field.name == "content-type" && field.value == kProblemType;
  });
  if (!is_problem) return;
  if (auto problem = parse_problem(reply.body)) {
    problem->request_id = id;
    reply.body = problem_json(*problem);
  }
}

}  // namespace

std::string request_id_of(std::string_view given) {
  const bool harmless = !given.empty() && given.size() <= 64 && std::all_of(given.begin(), given.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
  });
  if (harmless) return std::string(given);
  std::array<unsigned char, 8> random{};
  [[maybe_unused]] const ssize_t got = getrandom(random.data(), random.size(), 0);
  std::string id = "r-";
  for (const unsigned char byte : random) {
    id.push_back("0123456789abcdef"[byte >> 4]);
    id.push_back("0123456789abcdef"[byte & 15]);
  }
  return id;
}

Exchange::Exchange(ExchangeRules rules, Router router, std::function<std::optional<Reply>(Request&)> fallback,
                   Gate& uploads, HttpMetrics& metrics, LogLine log)
    : rules_(std::move(rules)),
      router_(std::move(router)),
      fallback_(std::move(fallback)),
      uploads_(uploads),
      metrics_(metrics),
      log_(std::move(log)) {}

/// A browser page of another origin may not change anything here, nor reach us under another name (DNS rebinding).
Answer<void> Exchange::check_origin(const Head& head) const {
  const std::string_view host = field_of(head, "host");
  const std::string_view origin = field_of(head, "origin");
  if (!rules_.hosts.empty() && !host.empty() &&
      std::find(rules_.hosts.begin(), rules_.hosts.end(), host_name(host)) == rules_.hosts.end())
    return refuse("misdirected", "this server does not answer under that Host name");
  const std::string_view site = field_of(head, "sec-fetch-site");  // only browsers send it, and truthfully
  const bool foreign =
      site.empty() ? !origin.empty() && without_scheme(origin) != host : site != "same-origin" && site != "none";
  if (changes_something(head) && foreign)
    return refuse("cross_origin", "pages of other origins may not change anything here");
  return {};
}

Answer<void> Exchange::check(const Head& head, const RouteMatch& match) const {
  if (auto origin = check_origin(head); !origin) return origin;
  if (!rules_.token_hashes.empty() && !is_open_to_all(match) && !carries_token(head, rules_.token_hashes))
    return refuse("unauthorized", "this server asks for a token: Authorization: Bearer TOKEN");
  if (match.endpoint == nullptr) return {};
  const std::string_view expect = field_of(head, "expect");
  if (!expect.empty() && expect != "100-continue")
    return refuse("expectation_failed", "only 100-continue is understood");
  if (!takes_body(*match.endpoint)) return {};
  const std::string_view encoding = field_of(head, "content-encoding");
  if (!encoding.empty() && encoding != "identity")
    return refuse("unsupported_encoding", "bodies are taken as they are, without Content-Encoding");
  if (!head.content_length) return refuse("length_required", "this request needs a Content-Length");
  if (*head.content_length > rules_.max_upload_bytes)
    return refuse("too_large", "an upload may have " + std::to_string(rules_.max_upload_bytes) + " bytes");
  return {};
}

Reply Exchange::dispatch(Request& request, const RouteMatch& match) {
  if (match.endpoint == nullptr) {
    if (!match.allow.empty())
      return request.head.method == "OPTIONS" ? options_reply(match) : method_not_allowed(match);
    auto file = fallback_(request);
    return file ? std::move(*file) : not_found();
  }
  if (!takes_body(*match.endpoint)) return (*match.handler)(request);
  request.upload = uploads_.enter();
  if (!request.upload)
    return problem_reply(make_problem("overloaded", "too many uploads at once; try again in a moment"));
  return (*match.handler)(request);
}

Reply Exchange::answer(const Head& head, Request& request, const RouteMatch& match, AccessEntry& entry) {
  if (auto allowed = check(head, match); !allowed) return problem_reply(allowed.error());
  const Problem generic =
      make_problem("internal", "something went wrong on our side; the log knows it by the request id");
  try {
    return dispatch(request, match);
  } catch (const std::exception& failure) {
    entry.fault = failure.what();
  } catch (...) {
    entry.fault = "an exception of unknown type";
  }
  return problem_reply(generic);
}

bool Exchange::serve(Connection& connection, std::string_view head_text, const std::string& peer) {
  const auto begin = std::chrono::steady_clock::now();
  AccessEntry entry;
  entry.peer = peer;
  auto head = parse_head(head_text);
  const bool understood = head.has_value();
  Request request;
  request.peer = peer;
  request.client = &connection;
  request.id = request_id_of(understood ? field_of(*head, "x-request-id") : std::string_view());
  ConnectionBody body(connection, understood ? head->content_length.value_or(0) : 0,
                      understood && field_of(*head, "expect") == "100-continue");
  request.body = &body;

  Reply reply;
  if (understood) {
    const RouteMatch match = router_.match(head->method, head->path);
    request.path_params = match.params;
    request.head = *head;
    entry.method = head->method;
    entry.path = head->path;
    entry.operation = match.endpoint != nullptr ? match.endpoint->operation : "none";
    reply = answer(*head, request, match, entry);
  } else {
    entry.operation = "none";
    reply = problem_reply(head.error());
  }
  stamp(reply, request.id);
  try {
    write_reply(connection, reply, request.id, entry.method == "HEAD");
  } catch (const std::exception& failure) {  // too late for a 500: the connection ends early and the client sees that
    entry.fault = failure.what();
  }

  entry.request_id = request.id;
  entry.status = reply.status;
  entry.bytes = connection.bytes_written();
  entry.seconds = seconds_since(begin);
  metrics_.request(entry.operation, entry.status, entry.seconds);
  if (log_) log_(access_line(entry));
  // After a refusal bytes may still be on their way, announced or not.
  return reply.status < 400 && body.drained();
}

}  // namespace kiln
