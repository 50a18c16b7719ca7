#pragma once
// What an operator does beside the running servers: `kilnd admin stats|gc|scrub|backup`. Each returns a line of JSON.
// Alone (SQLite), stats and gc need the data folder for themselves ("data_in_use"); scrub and backup run beside a
// server. In a fleet all but backup run beside it; PostgreSQL has tools of its own for that.

#include "server/work/service.h"

namespace kiln {

/// {"jobs": {...}, "blobs": n, "blob_bytes": n, "free_bytes": n}
Result<std::string> admin_stats(const ServiceOptions&);

/// Removes blobs that no job needs and nobody touched for the grace. {"removed": n}
Result<std::string> admin_gc(const ServiceOptions&);

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
