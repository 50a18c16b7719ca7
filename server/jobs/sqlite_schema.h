#pragma once
// The tables, and the settings that the promises rest on. Internal to server/jobs.

#include <filesystem>

#include "server/jobs/sqlite_db.h"

namespace kiln::sql {

inline constexpr int kSchemaVersion = 4;
using Clock = std::function<std::int64_t()>;

/// The one connection that writes: settings verified, file checked, tables there.
Result<std::unique_ptr<SqliteConnection>> open_writer(const std::filesystem::path& file, const Clock& now_ms);

/// A connection that only reads and never touches the write-ahead log's life.
Result<std::unique_ptr<SqliteConnection>> open_reader(const std::filesystem::path& file, const Clock& now_ms);

}  // namespace kiln::sql
