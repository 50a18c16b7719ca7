#pragma once
// What an operator does beside the running servers: `kilnd admin stats|gc|scrub|backup`. Each returns a line of JSON.
// Alone (SQLite), stats, gc and pin need the data folder for themselves ("data_in_use"); scrub and backup run beside a
// server. In a fleet all but backup run beside it; PostgreSQL has tools of its own for that.

#include "server/work/service.h"

namespace kiln {

/// {"jobs": {..., "pinned": n}, "blobs": n, "blob_bytes": n, "free_bytes": n}
Result<std::string> admin_stats(const ServiceOptions&);

/// Forgets jobs that are older than the retention of the options, and removes blobs that no job needs, nobody pinned
/// and nobody touched for the grace. {"forgotten": n, "removed": n}. `only_count`: how many it would be now; blobs of
/// jobs that would go are not among them yet.
Result<std::string> admin_gc(const ServiceOptions&, bool only_count);

/// Pins or unpins a job (by its id) or a blob of a tenant (by its SHA-256). {"pinned": b}
struct PinOrder {
  std::string what;
  std::string tenant;  // of a blob; empty: the tenant without a name
  bool pinned = true;
};
Result<std::string> admin_pin(const ServiceOptions&, const PinOrder&);

/// Reads every blob and compares its hash with its name. {"blobs": n, "bytes": n, "wrong": ["<sha256>", ...]}
/// `wrong` names blobs whose bytes are other ones or cannot be read; they stay where they are.
struct Scrub {
  std::string json;
  bool sound = true;
};
Result<Scrub> admin_scrub(const ServiceOptions&);

/// Copies (links, on one file system) jobs and blobs into a new folder that `kilnd --data` can serve. The server may
/// run meanwhile: jobs are those of one moment, and every blob they need is there. {"blobs": n, "bytes": n}
Result<std::string> admin_backup(const ServiceOptions&, const std::filesystem::path& target);

}  // namespace kiln
