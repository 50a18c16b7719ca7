#include "server/kilnd/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>

#include "core/bake/bake.h"
#include "server/webhooks/receivers.h"

namespace kiln {
namespace {

/// --max-upload-mb -> KILN_MAX_UPLOAD_MB
std::string variable_of(const std::string& flag) {
  std::string name = "KILN_" + flag.substr(2);
  std::ranges::replace(name, '-', '_');
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name;
}

template <class T>
CLI::Option* add(CLI::App& app, const std::string& flag, T& value, const std::string& text) {
  return app.add_option(flag, value, text)->envname(variable_of(flag))->capture_default_str();
}

/// Values that have no member of their own type in ServiceOptions.
struct RawOptions {
  std::string data = "kiln-data", worker_command, webhook_file;
  double soft_percent = 10, hard_percent = 5, blob_grace_s = 24 * 3600, first_retry_s = 10, lease_s = 60, keep_days = 0;
};

void add_options(CLI::App& app, DaemonOptions& options, RawOptions& raw) {
  add(app, "--data", raw.data, "folder of this server, with its jobs and blobs unless they live elsewhere");
  add(app, "--store", options.service.stores.jobs,
      "postgresql://user@host/database: jobs of a fleet (password: PGPASSWORD, a passfile, or KILN_STORE)");
  add(app, "--blobs", options.service.stores.blobs, "dir:/shared or s3://bucket: blobs of a fleet");
  add(app, "--s3-endpoint", options.service.stores.s3_endpoint,
      "https://host[:port] of s3:// (key: AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY)");
  add(app, "--s3-region", options.service.stores.s3_region, "region that requests are signed for");
  add(app, "--bind", options.address, "numeric address to listen on; all but loopback need --token-file");
  add(app, "--port", options.port, "port to listen on; 0 picks a free one")->check(CLI::Range(0, 65535));
  add(app, "--workers", options.service.workers, "jobs at a time, each in a process of its own")
      ->check(CLI::Range(0, 256));
  add(app, "--threads", options.service.threads, "threads of one worker; 0 shares the machine among the workers")
      ->check(CLI::Range(0, 1024));
  add(app, "--memory-mb", options.service.memory_mb,
      "memory that the limits of running jobs may add up to; 0: what the machine has, or its control group");
  add(app, "--share-s", options.service.sharing.least_s,
      "other workers may compute ranges of a bake that take at least so long; 0: none are given away")
      ->check(CLI::Range(0.0, 3600.0));
  add(app, "--token-file", options.token_file, "file of bearer tokens, one a line; without it nobody is asked");
  add(app, "--cors-origin", options.cors_origins,
      "https://host[:port] whose pages may use this server from a browser; more with commas")
      ->delimiter(',');
  add(app, "--trusted-proxy", options.trusted_proxies,
      "address or network of a reverse proxy whose X-Forwarded-For is believed; more with commas")
      ->delimiter(',');
  add(app, "--max-upload-mb", options.max_upload_mb, "largest upload in MiB");
  add(app, "--max-queued", options.service.max_queued, "waiting jobs before new ones are refused with 429");
  add(app, "--soft-free-percent", raw.soft_percent, "less free disk than this refuses uploads")
      ->check(CLI::Range(0.0, 100.0));
  add(app, "--hard-free-percent", raw.hard_percent, "less free disk than this lets the queue wait")
      ->check(CLI::Range(0.0, 100.0));
  add(app, "--blob-grace-s", raw.blob_grace_s, "how long an unused asset is kept")->check(CLI::NonNegativeNumber);
  add(app, "--keep-days", raw.keep_days,
      "how long jobs that ended are kept, unless pinned or their token says keep_days=; 0: for ever")
      ->check(CLI::Range(0.0, 36500.0));
  add(app, "--lease-s", raw.lease_s,
      "a job whose server is silent for so long goes to another; the same in all of a fleet")
      ->check(CLI::Range(1.0, 3600.0));
  add(app, "--first-retry-s", raw.first_retry_s, "pause after trouble of the machine, four times longer each time")
      ->check(CLI::NonNegativeNumber);
  add(app, "--webhook-file", raw.webhook_file,
      "file of receivers that are told when jobs end: https://address whsec_SECRET [tenant=NAME], one a line");
  app.add_flag("--webhook-private", options.service.webhooks.private_too,
               "receivers may be in this machine's own network, and http://")
      ->envname("KILN_WEBHOOK_PRIVATE");
  add(app, "--share-repeats", options.service.sharing.repeats, "for tests: see Sharing")->group("");
  add(app, "--worker-command", raw.worker_command, "another program as worker, for tests")->group("");
  app.add_flag("--require-sandbox", options.service.require_sandbox,
               "refuse to start where workers cannot be locked in")
      ->envname("KILN_REQUIRE_SANDBOX");
  app.add_flag("--quiet", options.quiet, "no log line per request")->envname("KILN_QUIET");
  app.set_version_flag("--version", std::string("kilnd ") + kEngineVersion);
}

std::string from_environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

tl::unexpected<EarlyExit> refuse(const std::string& why) {
  std::fprintf(stderr, "kilnd: %s\n", why.c_str());
  return tl::make_unexpected(EarlyExit{kExitConfig});
}

/// True when the address with a password came by the command line, where everyone sees it.
bool tells_password(const StoreOptions& stores, int argc, const char* const* argv) {
  const auto holds = [&](std::string_view word) { return word.find(stores.jobs) != std::string_view::npos; };
  return holds_password(stores) && std::any_of(argv, argv + argc, holds);
}

void finish(DaemonOptions& options, const RawOptions& raw) {
  options.service.data = raw.data;
  options.service.stores.s3_key = from_environment("AWS_ACCESS_KEY_ID");
  options.service.stores.s3_secret = from_environment("AWS_SECRET_ACCESS_KEY");
  if (!raw.worker_command.empty()) options.service.worker_command = {raw.worker_command};
  options.service.soft_free_fraction = raw.soft_percent / 100;
  options.service.hard_free_fraction = raw.hard_percent / 100;
  options.service.blob_grace = Millis(static_cast<std::int64_t>(raw.blob_grace_s * 1000));
  options.service.retention.others = Millis(static_cast<std::int64_t>(raw.keep_days * 24 * 3600 * 1000));
  options.service.lease = Millis(static_cast<std::int64_t>(raw.lease_s * 1000));
  options.service.first_retry = Millis(static_cast<std::int64_t>(raw.first_retry_s * 1000));
}

}  // namespace

bool is_loopback(const std::string& address) { return address == "::1" || address.starts_with("127."); }

tl::expected<DaemonOptions, EarlyExit> parse_options(int argc, const char* const* argv) {
  CLI::App app("kilnd bakes light: an HTTP server with a queue and worker processes.", "kilnd");
  DaemonOptions options;
  RawOptions raw;
  add_options(app, options, raw);
  app.fallthrough();
  const CLI::App* worker = app.add_subcommand("worker", "bake for a fleet, without an HTTP server");
  CLI::App* admin = app.add_subcommand("admin", "look after a store and end; prints a line of JSON");
  admin->add_option("what", options.admin, "stats, gc, scrub, backup, pin, or unpin")
      ->required()
      ->check(CLI::IsMember({"stats", "gc", "scrub", "backup", "pin", "unpin"}));
  admin->add_option("object", options.admin_object, "backup: a new folder; pin, unpin: a job's id or a file's SHA-256");
  admin->add_option("--tenant", options.admin_tenant, "pin, unpin: whose file");
  admin->add_flag("--dry-run", options.dry_run, "gc: tells how many would go");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return tl::make_unexpected(EarlyExit{app.exit(error) == 0 ? 0 : kExitUsage});
  }
  finish(options, raw);
  options.worker_only = worker->parsed();
  if (const auto sound = check_addresses(options.service.stores); !sound) return refuse(sound.error().message);
  if (tells_password(options.service.stores, argc, argv)) {
    return refuse("a password on the command line is seen by all: use PGPASSWORD, a passfile, or KILN_STORE");
  }
  if (!raw.webhook_file.empty()) {
    auto receivers = read_webhook_receivers(raw.webhook_file, options.service.webhooks.private_too);
    if (!receivers) return refuse(receivers.error().message);
    options.service.webhooks.receivers = std::move(*receivers);
  }
  const bool wants_object = options.admin == "backup" || options.admin.ends_with("pin");
  if (wants_object == options.admin_object.empty()) {
    std::fprintf(stderr, "kilnd: admin backup wants a folder, pin and unpin a job or a file, and nothing else does\n");
    return tl::make_unexpected(EarlyExit{kExitUsage});
  }
  if (options.worker_only && options.service.stores.jobs.empty()) {
    return refuse("a worker without --store postgresql://... has nobody to bake for");
  }
  if (!options.worker_only && options.admin.empty() && !is_loopback(options.address) && options.token_file.empty()) {
    return refuse("--bind " + options.address + " is open to others: give --token-file as well");
  }
  return options;
}

}  // namespace kiln
