#pragma once
// The tables, and the settings that the promises rest on. Internal to server/jobs.

#include <filesystem>

#include "server/jobs/sqlite_db.h"

namespace kiln::sql {

inline constexpr int kSchemaVersion = 1;

/// The one connection that writes: settings verified, file checked, tables there.
Result<Database> open_writer(const std::filesystem::path& file);

/// A connection that only reads and never touches the write-ahead log's life.
Result<Database> open_reader(const std::filesystem::path& file);

}  // namespace kiln::sql
