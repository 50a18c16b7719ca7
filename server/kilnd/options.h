#pragma once
// The command line of kilnd. Every flag is also an environment variable: --max-upload-mb is KILN_MAX_UPLOAD_MB. Secrets
// are environment variables alone, since everyone on a machine sees command lines.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/work/service.h"

namespace kiln {

struct DaemonOptions {
  ServiceOptions service;
  std::string address = "127.0.0.1";
  int port = 7878;  // 0: any free one
  std::string token_file;
  std::vector<std::string> cors_origins, trusted_proxies;
  std::uint64_t max_upload_mb = 8192;
  bool quiet = false;        // no line per request
  bool worker_only = false;  // `kilnd worker`: bakes for a fleet and serves nobody
  std::string admin;         // `kilnd admin WHAT`: stats, gc, scrub, backup, pin or unpin, and then the end
  std::string admin_object;  // the folder of a backup; the job or blob of a pin
  std::string admin_tenant;  // whose blob
  bool dry_run = false;      // of gc: tells and removes nothing
};

inline constexpr int kExitUsage = 2;
inline constexpr int kExitConfig = 78;  // sysexits: EX_CONFIG

/// What to do instead of serving: an exit code, after its text was printed.
struct EarlyExit {
  int code = 0;
};

/// Reads the command line. Help and mistakes are told on stdout and stderr and end the program.
tl::expected<DaemonOptions, EarlyExit> parse_options(int argc, const char* const* argv);

/// True for addresses that only this machine reaches.
bool is_loopback(const std::string& address);

}  // namespace kiln
