#include "server/http/httplib_server.h"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <set>
#include <utility>

#include "core/base/expects.h"
#include "server/http/route_pattern.h"

namespace kiln {
namespace {

/// What every reply carries unless its route says otherwise (reliability.md S7).
constexpr std::pair<const char*, const char*> kEverywhere[] = {
    {"x-content-type-options", "nosniff"},
    {"referrer-policy", "no-referrer"},
    {"cross-origin-resource-policy", "same-origin"},
    {"content-security-policy", "default-src 'none'; frame-ancestors 'none'"},
};

/// The methods that the library routes; HEAD goes with GET.
struct Verb {
  std::string_view name;
  httplib::Server& (httplib::Server::*add)(const std::string&, httplib::Server::Handler);
};
constexpr std::array<Verb, 6> kVerbs = {{{"GET", &httplib::Server::Get},
                                         {"POST", &httplib::Server::Post},
                                         {"PUT", &httplib::Server::Put},
                                         {"PATCH", &httplib::Server::Patch},
                                         {"DELETE", &httplib::Server::Delete},
                                         {"OPTIONS", &httplib::Server::Options}}};

/// One run of the library.
struct Visit {
  Sink* client = nullptr;
  Request* request = nullptr;        // null: `refusal` is the answer
  const Problem* refusal = nullptr;  // null: the request is routed
  std::string id;
  bool has_ranges = false;
  Outcome outcome;
};

/// The library's Request has no place for a pointer of ours, but a callable that only its client part uses.
struct VisitTag {
  Visit* visit;
  bool operator()(const httplib::Response&) const { return true; }
};

Visit& visit_of(const httplib::Request& in) {
  const VisitTag* tag = in.response_handler.target<VisitTag>();
  EXPECTS(tag != nullptr);  // absent only if the library refused a head that we made
  return *tag->visit;
}

/// The library reads the head that it is shown and then the end: never a byte of a body. It writes to the client, head
/// and content apart: the head waits for what follows, since two packets of a small reply cost a fifth of the
/// throughput.
class HeadStream : public httplib::Stream {
 public:
  HeadStream(std::string_view head, Sink& client) : head_(head), client_(&client) {}
  bool is_readable() const override { return !head_.empty(); }
  bool is_writable() const override { return !client_->client_gone(); }
  ssize_t read(char* out, std::size_t size) override {
    const std::size_t count = std::min(size, head_.size());
    std::memcpy(out, head_.data(), count);
    head_.remove_prefix(count);
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* bytes, std::size_t size) override {
    const bool is_head = std::exchange(is_head_, false);
    if (is_head || !held_.empty()) held_.append(bytes, size);
    const bool taken = is_head || (held_.empty() ? client_->write({bytes, size}) : flush());
    return taken ? static_cast<ssize_t>(size) : -1;
  }
  /// Sends what waits, if anything does.
  bool flush() { return client_->write(std::exchange(held_, {})); }
  void get_remote_ip_and_port(std::string&, int&) const override {}  // Request::peer is what we know
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }

 private:
  std::string_view head_;
  Sink* client_;
  std::string held_;
  bool is_head_ = true;
};

/// Where a content provider writes.
class ProviderSink : public Sink {
 public:
  ProviderSink(httplib::DataSink& to, Sink& client) : to_(&to), client_(&client) {}
  bool write(std::string_view bytes) override {
    written_ += bytes.size();
    return to_->write(bytes.data(), bytes.size());
  }
  bool client_gone() override { return client_->client_gone(); }
  std::uint64_t written() const { return written_; }

 private:
  httplib::DataSink* to_;
  Sink* client_;
  std::uint64_t written_ = 0;
};

using Stream = std::function<void(Sink&)>;

/// `length` bytes in one call. A stream that ends early ends the connection: the client sees that bytes are missing.
httplib::ContentProvider sized_provider(Stream stream, Sink& client) {
  return [stream = std::move(stream), &client](std::size_t, std::size_t length, httplib::DataSink& to) {
    ProviderSink sink(to, client);
    stream(sink);
    return sink.written() == length;
  };
}

httplib::ContentProviderWithoutLength open_provider(Stream stream, Sink& client) {
  return [stream = std::move(stream), &client](std::size_t, httplib::DataSink& to) {
    ProviderSink sink(to, client);
    stream(sink);
    to.done();
    return true;
  };
}

void put_reply(Visit& visit, Reply reply, httplib::Response& out) {
  out = {};
  out.status = reply.status;
  out.body = std::move(reply.body);
  if (reply.stream && !reply.stream_length)
    out.set_content_provider("", open_provider(std::move(reply.stream), *visit.client));
  else if (reply.stream && *reply.stream_length > 0)
    out.set_content_provider(*reply.stream_length, "", sized_provider(std::move(reply.stream), *visit.client));
  out.headers.clear();  // the type of the content is among our fields
  for (const Field& field : reply.fields) out.set_header(field.name, field.value);
  visit.has_ranges = out.has_header("accept-ranges");
}

/// The last word on a reply's fields, the library's own among them.
void finish(const httplib::Request& in, httplib::Response& out) {
  Visit& visit = visit_of(in);
  for (const auto& [name, value] : kEverywhere)
    if (!out.has_header(name)) out.set_header(name, value);
  if (!visit.id.empty()) out.set_header("x-request-id", visit.id);
  if (out.status == 204 || out.status == 304) out.headers.erase("Content-Length");
  if (!visit.has_ranges) out.headers.erase("Accept-Ranges");  // the library promises them to every HEAD
  visit.outcome.status = out.status;
}

std::string text_of(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& known) {
    return known.what();
  } catch (...) {
    return "an exception of unknown type";
  }
}

/// The log gets what was thrown, the client a sentence of ours (reliability.md H13).
void answer_exception(const httplib::Request& in, httplib::Response& out, const std::exception_ptr& failure) {
  Visit& visit = visit_of(in);
  visit.outcome.fault = text_of(failure);
  Problem generic = make_problem("internal", "something went wrong on our side; the log knows it by the request id");
  generic.request_id = visit.id;
  put_reply(visit, problem_reply(generic), out);
}

/// The library without its listening part.
class Library : public httplib::Server {
 public:
  Library() {
    svr_sock_ = 0;  // "still listening", else it would end every stream; the socket is the front's
    set_pre_routing_handler([](const httplib::Request& in, httplib::Response& out) {
      Visit& visit = visit_of(in);
      if (visit.refusal == nullptr) return HandlerResponse::Unhandled;
      put_reply(visit, problem_reply(*visit.refusal), out);
      return HandlerResponse::Handled;
    });
    set_exception_handler(answer_exception);
    set_post_routing_handler(finish);
  }

  void run(Visit& visit, const std::string& request_line) {
    HeadStream stream(request_line, *visit.client);
    bool closed = false;
    process_request(stream, true, closed, [&visit](httplib::Request& in) { in.response_handler = VisitTag{&visit}; });
    stream.flush();  // a head that nothing follows
  }
};

}  // namespace

struct HttplibServer::State {
  Answerer answer;
  Library library;

  /// The first pattern that matches wins: endpoints, then their paths with other methods, then everything else.
  State(const Handlers& handlers, const Handler& elsewhere, Answerer a) : answer(std::move(a)) {
    EXPECTS(handlers.size() == endpoints().size());
    std::set<std::string_view> paths;
    for (const Endpoint& endpoint : endpoints()) {
      EXPECTS(handlers.contains(endpoint.operation));
      add(endpoint.method, pattern_of(endpoint.path), {&endpoint, handlers.find(endpoint.operation)->second});
      paths.insert(endpoint.path);
    }
    for (const std::string_view path : paths) add_refusals(path);
    for (const Verb& verb : kVerbs) add(verb.name, {"/.*", {}}, {nullptr, elsewhere});
  }

  struct Target {
    const Endpoint* endpoint;
    Handler handler;
  };

  void add(std::string_view method, const RoutePattern& pattern, const Target& target) {
    const auto verb = std::ranges::find(kVerbs, method, &Verb::name);
    EXPECTS(verb != kVerbs.end());
    (library.*verb->add)(pattern.regex, [this, names = pattern.names, target](const auto& in, auto& out) {
      Visit& visit = visit_of(in);
      Request& request = *visit.request;
      EXPECTS(in.path == request.head.path);  // two readers, one meaning
      for (std::size_t i = 0; i < names.size(); ++i) request.path_params.emplace_back(names[i], in.matches[i + 1]);
      if (target.endpoint != nullptr) visit.outcome.operation = target.endpoint->operation;
      put_reply(visit, answer(target.endpoint, target.handler, request), out);
    });
  }

  void add_refusals(std::string_view path) {
    const std::string allow = allowed_methods(path);
    for (const Verb& verb : kVerbs)
      if (allow.find(verb.name) == std::string::npos)
        add(verb.name, pattern_of(path),
            {nullptr, verb.name == "OPTIONS" ? list_methods(allow) : method_not_allowed(allow)});
  }
};

HttplibServer::HttplibServer(const Handlers& handlers, const Handler& elsewhere, Answerer answer)
    : state_(std::make_unique<State>(handlers, elsewhere, std::move(answer))) {}

HttplibServer::~HttplibServer() = default;

Outcome HttplibServer::serve(Request& request) const {
  Visit visit;
  visit.client = request.client;
  visit.request = &request;
  visit.id = request.id;
  try {
    state_->library.run(visit, request.head.method + " " + request.head.raw_path + " HTTP/1.1\r\n\r\n");
  } catch (const std::exception& failure) {  // too late for a 500: the connection ends early and the client sees that
    visit.outcome.fault = failure.what();
  }
  return visit.outcome;
}

Outcome HttplibServer::refuse(const Problem& problem, Sink& client) const {
  Visit visit;
  visit.client = &client;
  visit.refusal = &problem;
  visit.id = problem.request_id;
  state_->library.run(visit, "GET / HTTP/1.1\r\n\r\n");  // the refusal is the answer, whatever was asked
  return visit.outcome;
}

}  // namespace kiln
