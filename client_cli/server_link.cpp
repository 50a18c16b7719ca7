#include "client_cli/server_link.h"

#include <httplib.h>

#include <algorithm>
#include <thread>

namespace kiln {
namespace {

constexpr int kConnectTimeoutS = 5;
constexpr int kReplyTimeoutS = 180;  // a plan of a large scene is worked out while we wait
constexpr int kStreamTimeoutS = 60;  // event streams carry a heartbeat well below this
constexpr int kMaxRetries = 20;
constexpr int kLongestRetryS = 60;
constexpr std::size_t kSendBytes = 1U << 18;
constexpr std::size_t kMaxProblemBytes = 1U << 20;

struct Url {
  std::string origin, prefix;
};

std::optional<Url> parse_url(std::string url) {
  while (!url.empty() && url.back() == '/') url.pop_back();
  const auto scheme = url.find("://");
  if (scheme == std::string::npos) return parse_url("http://" + url);
  const std::string name = url.substr(0, scheme);
  const auto path = url.find('/', scheme + 3);
  Url out{url.substr(0, path), path == std::string::npos ? "" : url.substr(path)};
  const bool known = (name == "http" || name == "https") && out.origin.size() > scheme + 3;
  const bool clean = url.find_first_of(" \t\r\n?#@") == std::string::npos;
  return known && clean ? std::optional(out) : std::nullopt;
}

/// The problem that a reply of 400 or more carries; a reply of another program gets one from its status.
Failure failure_of_reply(int status, const std::string& body) {
  Problem problem;
  if (const auto parsed = parse_problem(body)) problem = *parsed;
  problem.status = status;
  if (problem.detail.empty()) problem.detail = "the server answered with status " + std::to_string(status);
  return failure_of(problem);
}

HttpReply reply_of(httplib::Response response) {
  const std::string offset = response.get_header_value("Upload-Offset");
  return {response.status, std::move(response.body), response.get_header_value("Location"),
          std::strtoull(offset.c_str(), nullptr, 10), response.has_header("Upload-Asset")};
}

httplib::Headers to_headers(const HttpHeaders& headers) { return {headers.begin(), headers.end()}; }

std::size_t size_of(const HttpBody& body) {
  std::size_t size = 0;
  for (const auto piece : body.pieces) size += piece.size();
  return size;
}

/// Sends the piece that holds `offset`, at most kSendBytes of it.
bool send_piece(const HttpBody& body, std::size_t offset, httplib::DataSink& sink) {
  for (const auto piece : body.pieces) {
    if (offset < piece.size()) {
      const std::string_view part = piece.substr(offset, kSendBytes);
      return sink.write(part.data(), part.size());
    }
    offset -= piece.size();
  }
  return false;
}

std::string reason_of(httplib::Error error) {
  switch (error) {
    case httplib::Error::Connection:
      return "cannot be reached";
    case httplib::Error::ConnectionTimeout:
      return "does not answer";
    case httplib::Error::Read:
      return "closed the connection or fell silent before its reply was whole";
    case httplib::Error::Write:
      return "closed the connection while a request was sent";
    case httplib::Error::SSLConnection:
    case httplib::Error::SSLLoadingCerts:
    case httplib::Error::SSLServerVerification:
      return "could not be trusted (TLS)";
    default:
      return "could not be talked to";
  }
}

}  // namespace

tl::unexpected<Failure> interrupted() { return fail(ExitCode::interrupted, "interrupted", "interrupted"); }

bool sleep_unless_interrupted(double seconds, const Interrupt& interrupt) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end && !interrupt.raised())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return !interrupt.raised();
}

struct ServerLink::Connection {
  Session& session;
  std::string url, prefix;
  httplib::Client client;

  Connection(Session& s, const Url& parsed)
      : session(s), url(parsed.origin + parsed.prefix), prefix(parsed.prefix), client(parsed.origin) {
    client.set_connection_timeout(kConnectTimeoutS);
    client.set_read_timeout(kReplyTimeoutS);
    client.set_write_timeout(kStreamTimeoutS);
    client.set_keep_alive(false);
    client.set_follow_location(false);
    client.set_tcp_nodelay(true);
    client.set_socket_options([this](socket_t socket) { session.interrupt.shut_socket(static_cast<int>(socket)); });
    if (!session.common.token.empty()) client.set_bearer_token_auth(session.common.token);
  }

  Failure unreachable(httplib::Error error) const {
    if (session.interrupt.raised()) return interrupted().value();
    return fail(ExitCode::unreachable, "unreachable", reason_of(error), url).value();
  }

  /// One request, sent again while the server asks for patience.
  Outcome<httplib::Response> request(const std::function<httplib::Result()>& send) {
    for (int attempt = 0;; ++attempt) {
      if (session.interrupt.raised()) return interrupted();
      const httplib::Result result = send();
      session.interrupt.shut_socket(-1);
      if (!result) return tl::make_unexpected(unreachable(result.error()));
      const int wait = std::atoi(result->get_header_value("Retry-After").c_str());
      const bool busy = result->status == 429 || result->status == 503;
      if (!busy || wait < 1 || wait > kLongestRetryS || attempt == kMaxRetries) return *result;
      say("the server is busy; trying again in " + std::to_string(wait) + " s");
      if (!sleep_unless_interrupted(wait, session.interrupt)) return interrupted();
    }
  }

  Outcome<HttpReply> reply(const std::function<httplib::Result()>& send) {
    KILN_TRY(response, request(send));
    if (response.status >= 400) return tl::make_unexpected(failure_of_reply(response.status, response.body));
    return reply_of(std::move(response));
  }
};

ServerLink::ServerLink(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}
ServerLink::~ServerLink() = default;
ServerLink::ServerLink(ServerLink&&) noexcept = default;

Outcome<ServerLink> ServerLink::open(Session& session) {
  const std::string& address = session.common.server;
  if (address.empty())
    return fail(ExitCode::usage, "no_server", "needs a server: give --server URL or set KILN_SERVER");
  const auto url = parse_url(address);
  if (!url)
    return fail(ExitCode::usage, "bad_server", "is no server address; one looks like http://127.0.0.1:8321", address);
  auto connection = std::make_unique<Connection>(session, *url);
  if (!connection->client.is_valid()) return fail(ExitCode::usage, "bad_server", "is no server address", address);
  return ServerLink(std::move(connection));
}

const std::string& ServerLink::url() const { return connection_->url; }
Session& ServerLink::session() const { return connection_->session; }

Outcome<HttpReply> ServerLink::get(const std::string& path) {
  return connection_->reply([&] { return connection_->client.Get(connection_->prefix + path); });
}

Outcome<HttpReply> ServerLink::head(const std::string& path, const HttpHeaders& headers) {
  KILN_TRY(response, connection_->request(
                         [&] { return connection_->client.Head(connection_->prefix + path, to_headers(headers)); }));
  return reply_of(std::move(response));
}

Outcome<HttpReply> ServerLink::remove(const std::string& path) {
  return connection_->reply([&] { return connection_->client.Delete(connection_->prefix + path); });
}

Outcome<HttpReply> ServerLink::post(const std::string& path, const HttpHeaders& headers, const HttpBody& body) {
  return connection_->reply([&] {
    return connection_->client.Post(
        connection_->prefix + path, to_headers(headers), size_of(body),
        [&](std::size_t offset, std::size_t, httplib::DataSink& sink) { return send_piece(body, offset, sink); },
        body.media_type);
  });
}

Outcome<HttpReply> ServerLink::put(const std::string& path, const HttpHeaders& headers, const HttpBody& body) {
  return connection_->reply([&] {
    return connection_->client.Put(
        connection_->prefix + path, to_headers(headers), size_of(body),
        [&](std::size_t offset, std::size_t, httplib::DataSink& sink) { return send_piece(body, offset, sink); },
        body.media_type);
  });
}

Outcome<HttpReply> ServerLink::patch(const std::string& path, const HttpHeaders& headers, const HttpBody& body) {
  return connection_->reply([&] {
    return connection_->client.Patch(
        connection_->prefix + path, to_headers(headers), size_of(body),
        [&](std::size_t offset, std::size_t, httplib::DataSink& sink) { return send_piece(body, offset, sink); },
        body.media_type);
  });
}

Outcome<void> ServerLink::stream(const std::string& path, const HttpHeaders& headers, const ByteSink& sink) {
  int status = 0;
  bool ended = false;
  std::string problem;
  connection_->client.set_read_timeout(kStreamTimeoutS);
  const Outcome<httplib::Response> response = connection_->request([&] {
    return connection_->client.Get(
        connection_->prefix + path, to_headers(headers),
        [&](const httplib::Response& head) {
          status = head.status;
          return true;
        },
        [&](const char* data, std::size_t size) {
          if (status < 400) {
            ended = !sink({data, size});
            return !ended && !connection_->session.interrupt.raised();
          }
          problem.append(data, std::min(size, kMaxProblemBytes - std::min(problem.size(), kMaxProblemBytes)));
          return true;
        });
  });
  connection_->client.set_read_timeout(kReplyTimeoutS);
  if (ended) return {};
  if (connection_->session.interrupt.raised()) return interrupted();
  if (!response) return tl::make_unexpected(response.error());
  if (status >= 400) return tl::make_unexpected(failure_of_reply(status, problem));
  return {};
}

}  // namespace kiln
