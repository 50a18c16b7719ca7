// kilnd: serves HTTP and supervises its workers. `kilnd worker` only does the latter, for a fleet. `kilnd bake-worker
// FOLDER` is such a worker. `kilnd admin` looks after the store.

#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "server/http/auth.h"
#include "server/http/cors.h"
#include "server/http/http_server.h"
#include "server/kilnd/options.h"
#include "server/work/admin.h"
#include "server/work/bake_worker.h"
#include "server/work/sandbox.h"
#include "server/work/service.h"
#include "server/work/worker_protocol.h"

namespace kiln {
namespace {

int complain(const Fault& fault) {
  std::fprintf(stderr, "kilnd: %s\n", fault.message.c_str());
  for (const char* config : {"data_in_use", "schema_too_new", "store_unsafe", "bad_token_file", "blobs_refused",
                             "blobs_of_another", "bad_origin", "bad_address"}) {
    if (fault.code == config) return kExitConfig;
  }
  return 1;
}

sigset_t end_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  return set;
}

/// Waits for TERM or INT, which every thread blocks, and ends server and service in order.
std::thread drain_on_signal(HttpServer& server, Service& service) {
  return std::thread([&server, &service] {
    const sigset_t ends = end_signals();
    int received = 0;
    ::sigwait(&ends, &received);
    server.drain();   // accepts nothing more
    service.drain();  // event streams end, running jobs go back to the queue
  });
}

/// The options of the service, with what the token file says of retention. A worker of a fleet knows no tokens, and
/// leaves old jobs to those who do.
Result<ServiceOptions> with_retention(const DaemonOptions& options) {
  ServiceOptions service = options.service;
  if (options.worker_only) service.retention = {};
  if (options.token_file.empty()) return service;
  KILN_TRY(tokens, read_tokens(options.token_file));
  service.retention.tenants = kept_by_tenant(tokens);
  return service;
}

Result<HttpOptions> http_options(const DaemonOptions& options) {
  HttpOptions http;
  http.address = options.address;
  http.port = options.port;
  http.max_upload_bytes = options.max_upload_mb << 20;
  if (is_loopback(options.address)) http.hosts = loopback_hosts();
  if (options.quiet) http.log = {};
  for (const std::string& origin : options.cors_origins) {
    if (!is_origin(origin)) return fault("bad_origin", "'" + origin + "' is no origin like https://studio.example");
  }
  http.origins = options.cors_origins;
  KILN_TRY(proxies, AddressList::of(options.trusted_proxies));
  http.proxies = std::move(proxies);
  if (!options.token_file.empty()) {
    KILN_TRY(tokens, read_tokens(options.token_file));
    http.tokens = std::move(tokens);
  }
  return http;
}

std::string url(const std::string& address, int port) {
  const bool v6 = address.find(':') != std::string::npos;
  return "http://" + (v6 ? "[" + address + "]" : address) + ":" + std::to_string(port);
}

/// True when the workers will be as locked in as the options demand.
bool check_sandbox(bool required) {
  const Sandbox sandbox = sandbox_support();
  if (sandbox.whole()) return true;
  std::fprintf(stderr, "kilnd: this kernel does not lock workers in:%s%s\n", sandbox.files ? "" : " no Landlock",
               sandbox.calls ? "" : " no seccomp");
  return !required;
}

/// A worker of a fleet: the service without a door.
int work(Service& service) {
  service.start();
  std::fprintf(stderr, "kilnd works for its fleet\n");
  const sigset_t ends = end_signals();
  int received = 0;
  ::sigwait(&ends, &received);
  service.drain();
  return 0;
}

Result<std::string> admin_answer(const DaemonOptions& options, bool& sound) {
  if (options.admin == "stats") return admin_stats(options.service);
  if (options.admin == "gc") {
    KILN_TRY(rules, with_retention(options));
    return admin_gc(rules, options.dry_run);
  }
  if (options.admin == "backup") return admin_backup(options.service, options.admin_object);
  if (options.admin == "pin" || options.admin == "unpin") {
    return admin_pin(options.service, {options.admin_object, options.admin_tenant, options.admin == "pin"});
  }
  KILN_TRY(scrub, admin_scrub(options.service));
  sound = scrub.sound;
  return scrub.json;
}

int administer(const DaemonOptions& options) {
  bool sound = true;
  const auto answer = admin_answer(options, sound);
  if (!answer) return complain(answer.error());
  std::printf("%s\n", answer->c_str());
  return sound ? 0 : 1;
}

int serve(const DaemonOptions& options) {
  if (!check_sandbox(options.service.require_sandbox)) return kExitConfig;
  const sigset_t ends = end_signals();
  ::pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // before the first thread
  ::signal(SIGPIPE, SIG_IGN);
  const auto http = http_options(options);
  if (!http) return complain(http.error());
  const auto rules = with_retention(options);
  if (!rules) return complain(rules.error());
  auto service = Service::open(*rules);
  if (!service) return complain(service.error());
  if (options.worker_only) return work(**service);
  HttpServer server(*http, **service);
  const auto port = server.bind();
  if (!port) return complain(port.error());
  std::thread drain = drain_on_signal(server, **service);
  (*service)->start();
  std::fprintf(stderr, "kilnd listening on %s\n", url(options.address, *port).c_str());
  server.run();
  drain.join();
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  using namespace kiln;
  // A worker leaves without unwinding: its results are on disk and its memory goes faster in one piece.
  if (argc > 1 && std::string_view(argv[1]) == kWorkerWord) std::_Exit(bake_worker_main(argc - 1, argv + 1));
  const auto options = parse_options(argc, argv);
  if (!options) return options.error().code;
  return options->admin.empty() ? serve(*options) : administer(*options);
}
