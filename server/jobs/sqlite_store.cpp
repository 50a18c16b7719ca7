#include "server/jobs/sqlite_store.h"

#include <chrono>

#include "server/jobs/sqlite_schema.h"
#include "server/jobs/sqlite_store_impl.h"

namespace kiln {
namespace {

std::int64_t system_now_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<Millis>(now).count();
}

}  // namespace

Result<std::unique_ptr<JobStore>> open_sqlite_store(const SqliteOptions& options) {
  KILN_TRY(writer, sql::open_writer(options.file));
  KILN_TRY(reader, sql::open_reader(options.file));
  auto now = options.now_ms ? options.now_ms : system_now_ms;
  return std::make_unique<sql::SqliteStore>(std::move(writer), std::move(reader), std::move(now));
}

}  // namespace kiln
