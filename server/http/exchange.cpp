#include "server/http/exchange.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>

#include "server/api/job_request.h"
#include "server/api/upload_fields.h"
#include "server/http/parse_head.h"

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
bool is_open_to_all(const Endpoint* endpoint) {
  if (endpoint == nullptr) return false;
  const std::string_view name = endpoint->operation;
  return name == "health" || name == "readiness" || name == "version";
}

/// Bytes for a connection that has no worker.
class TextSink : public Sink {
 public:
  bool write(std::string_view bytes) override {
    text.append(bytes);
    return true;
  }
  bool client_gone() override { return false; }
  std::string text;
};

/// Puts the request id into a problem that a handler made without knowing it, and notes its code.
void stamp(Reply& reply, Request& request) {
  const bool is_problem = std::any_of(reply.fields.begin(), reply.fields.end(), [](const Field& field) {
    return field.name == "content-type" && field.value == kProblemType;
  });
  if (!is_problem) return;
  if (auto problem = parse_problem(reply.body)) {
    problem->request_id = request.id;
    request.refusal = problem->code;
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

Exchange::Exchange(ExchangeRules rules, Service& service, const Handlers& handlers, const Handler& elsewhere,
                   Gate& uploads, HttpMetrics& metrics, LogLine log)
    : rules_(std::move(rules)),
      service_(service),
      cors_(rules_.origins),
      visitors_(rules_.tokens, service),
      uploads_(uploads),
      metrics_(metrics),
      log_(std::move(log)),
      library_(handlers, elsewhere, [this](const Endpoint* endpoint, const Handler& handler, Request& request) {
        Reply reply = dispatch(endpoint, handler, request);
        stamp(reply, request);
        if (endpoint != nullptr && endpoint->tag == "uploads") reply.fields.push_back({"tus-resumable", kTusVersion});
        cors_.open(reply, request.head);
        return reply;
      }) {}

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
  if (changes_something(head) && foreign && !cors_.allows(head))
    return refuse("cross_origin", "pages of other origins may not change anything here");
  return {};
}

/// The one who asks; null where nobody is asked for a token.
Answer<Visitor*> Exchange::check_token(const Head& head, const Endpoint* endpoint) const {
  if (visitors_.anyone() || is_open_to_all(endpoint)) return nullptr;
  Visitor* visitor = visitors_.find(head);
  if (visitor == nullptr) return refuse("unauthorized", "this server asks for a token: Authorization: Bearer TOKEN");
  const bool metrics = endpoint != nullptr && endpoint->operation == "metrics";
  const AccessToken& may = visitor->token;
  if (metrics ? !may.admin : changes_something(head) ? !may.submit : !may.read)
    return refuse("forbidden", "this token is not for that");
  if (!visitor->rate.take(std::chrono::steady_clock::now()))
    return refuse("rate_limited", "this token is used too often; try again in a moment");
  return visitor;
}

Answer<void> Exchange::check_body(const Head& head, const Endpoint& endpoint) const {
  const std::string_view expect = field_of(head, "expect");
  if (!expect.empty() && expect != "100-continue")
    return refuse("expectation_failed", "only 100-continue is understood");
  if (!takes_body(endpoint)) return {};
  const std::string_view encoding = field_of(head, "content-encoding");
  if (!encoding.empty() && encoding != "identity")
    return refuse("unsupported_encoding", "bodies are taken as they are, without Content-Encoding");
  if (!head.content_length) return refuse("length_required", "this request needs a Content-Length");
  if (*head.content_length > rules_.max_upload_bytes)
    return refuse("too_large", "an upload may have " + std::to_string(rules_.max_upload_bytes) + " bytes");
  return {};
}

/// Pages have parameters of their own (web_viewer), which only they read.
Answer<void> Exchange::check_query(const Head& head, const Endpoint& endpoint) const {
  if (head.params.empty() || endpoint.tag == "viewer") return {};
  const auto values = take_params(head.params, query_names(endpoint));
  if (!values) return tl::make_unexpected(values.error());
  return {};
}

Reply Exchange::dispatch(const Endpoint* endpoint, const Handler& handler, Request& request) {
  if (auto origin = check_origin(request.head); !origin) return problem_reply(origin.error());
  if (cors_.is_preflight(request.head)) return Cors::preflight(handler(request));  // it carries no token
  auto visitor = check_token(request.head, endpoint);
  if (!visitor) return problem_reply(visitor.error());
  request.service = *visitor == nullptr ? &service_ : &(*visitor)->service;
  if (endpoint == nullptr) return handler(request);
  if (auto query = check_query(request.head, *endpoint); !query) return problem_reply(query.error());
  if (auto body = check_body(request.head, *endpoint); !body) return problem_reply(body.error());
  if (!takes_body(*endpoint)) return handler(request);
  const Pass own = *visitor == nullptr ? Pass() : (*visitor)->uploads.enter();
  if (*visitor != nullptr && !own)
    return problem_reply(make_problem("quota", "this token has too many uploads under way; try again in a moment"));
  const Pass shared = uploads_.enter();
  if (!shared) return problem_reply(make_problem("overloaded", "too many uploads at once; try again in a moment"));
  request.upload = std::make_shared<std::pair<Pass, Pass>>(own, shared);
  return take_body(handler, request, *visitor);
}

/// The bytes of the day are counted as announced; those that did not come are given back.
Reply Exchange::take_body(const Handler& handler, Request& request, Visitor* visitor) {
  if (visitor == nullptr || visitor->token.max_daily_bytes == 0) return handler(request);
  struct Charge {
    Service& service;
    const AccessToken& token;
    const BodySource& body;
    std::int64_t day;
    ~Charge() {
      const std::uint64_t missing = body.length() - body.taken();
      if (missing > 0) static_cast<void>(service.refund_upload(token.tenant, missing, day));
    }
  };
  const AccessToken& token = visitor->token;
  const auto charged = visitor->service.charge_upload(token.tenant, request.body->length(), token.max_daily_bytes);
  if (!charged) return problem_reply(problem_of(charged.error()));
  const Charge charge{visitor->service, token, *request.body, *charged};
  return handler(request);
}

bool Exchange::serve(Connection& connection, std::string_view head_text, const std::string& peer) {
  const auto begin = std::chrono::steady_clock::now();
  auto head = parse_head(head_text);
  Request request;
  if (head) request.head = std::move(*head);
  const bool forwarded = count_fields(request.head, "x-forwarded-for") == 1;
  request.peer = forwarded ? client_address(peer, field_of(request.head, "x-forwarded-for"), rules_.proxies) : peer;
  request.client = &connection;
  request.id = request_id_of(field_of(request.head, "x-request-id"));
  ConnectionBody body(connection, request.head.content_length.value_or(0),
                      field_of(request.head, "expect") == "100-continue");
  request.body = &body;

  if (!head) {
    head.error().request_id = request.id;
    request.refusal = head.error().code;
  }
  const Outcome outcome = head ? library_.serve(request) : library_.refuse(head.error(), connection);

  AccessEntry entry;
  entry.request_id = request.id;
  entry.peer = request.peer;
  entry.method = request.head.method;
  entry.path = request.head.path;
  entry.operation = outcome.operation;
  entry.fault = outcome.fault;
  entry.status = outcome.status;
  entry.bytes = connection.bytes_written();
  entry.seconds = seconds_since(begin);
  metrics_.request(entry.operation, entry.status, entry.seconds, request.refusal);
  if (log_) log_(access_line(entry));
  // After a refusal bytes may still be on their way, announced or not.
  return outcome.status > 0 && outcome.status < 400 && body.drained();
}

std::string Exchange::refusal_text(const Problem& problem) const {
  TextSink sink;
  library_.refuse(problem, sink);
  return sink.text;
}

}  // namespace kiln
