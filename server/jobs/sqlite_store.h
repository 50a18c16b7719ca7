#pragma once
// The embedded store: one SQLite file, one read-write connection behind a mutex, read-only ones for readers.

#include <filesystem>
#include <functional>
#include <memory>

#include "server/jobs/job_store.h"

namespace kiln {

struct SqliteOptions {
  std::filesystem::path file;
  std::function<std::int64_t()> now_ms;  // the store's clock; the system's when empty
};

/// Opens or makes the database, verifies every setting by reading it back and the file by quick_check.
/// Refuses a schema newer than this program ("schema_too_new").
Result<std::unique_ptr<JobStore>> open_sqlite_store(const SqliteOptions&);

/// Copies the database as it is at one moment into a new file; its server may go on writing. Fails with store_failed,
/// disk_full, and not_found when there is no database.
Result<void> backup_sqlite_store(const std::filesystem::path& file, const std::filesystem::path& target);

}  // namespace kiln
