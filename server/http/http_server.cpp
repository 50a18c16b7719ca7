#include "server/http/http_server.h"

#include <pthread.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>

#include "core/base/expects.h"
#include "server/http/exchange.h"
#include "server/http/routes.h"

namespace kiln {
namespace {

std::int64_t now_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

FrontOptions front_options(const HttpOptions& options) {
  FrontOptions front = options.front;
  front.address = options.address;
  front.port = options.port;
  front.proxies = options.proxies;
  front.threads = options.max_uploads + options.max_streams + options.max_downloads + options.quick_threads;
  return front;
}

/// As many descriptors as the machine allows: connections are capped by us, not by EMFILE.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

Handlers all_routes(RouteContext& context) {
  Handlers all;
  for (Handlers part : {job_routes(context), event_routes(context), artifact_routes(context), asset_routes(context),
                        upload_routes(context), recipe_routes(context), service_routes(context), viewer_routes()})
    all.merge(part);
  return all;
}

/// The library's routes are std::regex, which recurses for every byte of a path: 1.3 MB for the longest. Under a tight
/// `ulimit -s` (or none: then threads get 2 MB) one such request would end the server (reliability.md H14).
void deepen_stacks() {
  constexpr std::size_t kStackBytes = 8u << 20;
  pthread_attr_t defaults;
  EXPECTS(pthread_getattr_default_np(&defaults) == 0);
  std::size_t bytes = 0;
  EXPECTS(pthread_attr_getstacksize(&defaults, &bytes) == 0);
  if (bytes < kStackBytes)
    EXPECTS(pthread_attr_setstacksize(&defaults, kStackBytes) == 0 && pthread_setattr_default_np(&defaults) == 0);
  pthread_attr_destroy(&defaults);
}

}  // namespace

struct HttpServer::State {
  Service& service;
  Gate uploads, streams, downloads;
  std::atomic<bool> draining{false};
  HttpMetrics metrics;
  RouteContext context;
  Exchange exchange;
  Front front;

  State(const HttpOptions& options, Service& s)
      : service(s),
        uploads(options.max_uploads),
        streams(options.max_streams),
        downloads(options.max_downloads),
        context{s,
                streams,
                downloads,
                draining,
                options.heartbeat,
                [this] { return metrics_text(); },
                options.max_upload_bytes},
        exchange({options.max_upload_bytes, options.hosts, options.origins, options.proxies, options.tokens}, s,
                 all_routes(context), viewer_file, uploads, metrics, options.log),
        front(
            front_options(options),
            [this](Connection& connection, std::string_view head, const std::string& peer) {
              return exchange.serve(connection, head, peer);
            },
            [this](const Problem& problem) { return exchange.refusal_text(problem); }) {}

  std::string metrics_text() {
    MetricsInput in;
    in.front = front.stats();
    in.service = service.stats();
    in.uploads = uploads.inside();
    in.streams = streams.inside();
    in.downloads = downloads.inside();
    in.now_ms = now_ms();
    return metrics.text(in);
  }
};

std::vector<std::string> loopback_hosts() { return {"127.0.0.1", "localhost", "[::1]"}; }

HttpServer::HttpServer(const HttpOptions& options, Service& service)
    : state_(std::make_unique<State>(options, service)) {
  raise_descriptor_limit();
  deepen_stacks();
}

HttpServer::~HttpServer() = default;

Result<int> HttpServer::bind() { return state_->front.bind(); }

void HttpServer::run() { state_->front.run(); }

void HttpServer::drain() noexcept {
  state_->draining.store(true);
  state_->front.drain();
}

}  // namespace kiln
