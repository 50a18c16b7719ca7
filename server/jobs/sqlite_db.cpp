#include "server/jobs/sqlite_db.h"

#include <sqlite3.h>

#include <cerrno>

#include "core/base/expects.h"

namespace kiln::sql {
namespace {

/// A full disk shows as SQLITE_FULL or as an I/O error whose errno says so. SQLite's own text may hold paths: not told.
tl::unexpected<Fault> database_fault(sqlite3* handle) {
  const int code = sqlite3_errcode(handle);
  const int system = sqlite3_system_errno(handle);
  const bool full = code == SQLITE_FULL || (code == SQLITE_IOERR && (system == ENOSPC || system == EDQUOT));
  if (full) return fault("disk_full", "the job store has no space left");
  return fault("store_failed",
               "the job store failed with SQLite code " + std::to_string(sqlite3_extended_errcode(handle)));
}

struct CloseStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

void bind(sqlite3_stmt* statement, int index, const Value& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) {
    sqlite3_bind_int64(statement, index, *number);
  } else if (const auto* real = std::get_if<double>(&value)) {
    sqlite3_bind_double(statement, index, *real);
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    sqlite3_bind_text64(statement, index, text->data(), text->size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  } else {
    sqlite3_bind_null(statement, index);
  }
}

Value cell_of(sqlite3_stmt* statement, int column) {
  switch (sqlite3_column_type(statement, column)) {
    case SQLITE_NULL:
      return nullptr;
    case SQLITE_INTEGER:
      return std::int64_t{sqlite3_column_int64(statement, column)};
    case SQLITE_FLOAT:
      return sqlite3_column_double(statement, column);
    default:
      break;
  }
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
  if (bytes == nullptr) return std::string();
  return std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement, column)));
}

Row row_of(sqlite3_stmt* statement) {
  std::vector<Value> cells;
  for (int column = 0; column < sqlite3_column_count(statement); ++column) cells.push_back(cell_of(statement, column));
  return Row(std::move(cells));
}

}  // namespace

Result<std::unique_ptr<SqliteConnection>> SqliteConnection::open(const std::filesystem::path& file, Mode mode,
                                                                 std::function<std::int64_t()> now_ms) {
  sqlite3* handle = nullptr;
  const int access = mode == Mode::read_only ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  const int code = sqlite3_open_v2(file.c_str(), &handle, access | SQLITE_OPEN_NOMUTEX, nullptr);
  std::unique_ptr<SqliteConnection> db(new SqliteConnection(handle, std::move(now_ms)));
  if (code != SQLITE_OK) return database_fault(handle);
  sqlite3_extended_result_codes(handle, 0);
  if (mode == Mode::read_only) sqlite3_db_config(handle, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  return db;
}

SqliteConnection::~SqliteConnection() { sqlite3_close_v2(handle_); }

Result<void> SqliteConnection::execute(const std::string& statements) {
  if (sqlite3_exec(handle_, statements.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return database_fault(handle_);
}

Result<Rows> SqliteConnection::ask(const std::string& statement, const std::vector<Value>& values) {
  sqlite3_stmt* raw = nullptr;
  const int length = static_cast<int>(statement.size());
  if (sqlite3_prepare_v2(handle_, statement.data(), length, &raw, nullptr) != SQLITE_OK) return database_fault(handle_);
  const std::unique_ptr<sqlite3_stmt, CloseStatement> prepared(raw);
  int index = 0;
  for (const Value& value : values) bind(raw, ++index, value);
  Rows rows;
  while (true) {
    const int code = sqlite3_step(raw);
    if (code == SQLITE_DONE) break;
    if (code != SQLITE_ROW) return database_fault(handle_);
    rows.all.push_back(row_of(raw));
  }
  rows.changed = sqlite3_changes(handle_);
  return rows;
}

Result<Transaction> Transaction::begin(SqliteConnection& db) {
  KILN_DO(db.execute("BEGIN IMMEDIATE"));
  return Transaction(db);
}

Transaction::Transaction(Transaction&& other) noexcept : db_(std::exchange(other.db_, nullptr)) {}

Transaction::~Transaction() {
  if (db_ != nullptr) static_cast<void>(db_->execute("ROLLBACK"));  // SQLite may have rolled back by itself already
}

Result<void> Transaction::commit() {
  EXPECTS(db_ != nullptr);
  KILN_DO(db_->execute("COMMIT"));
  db_ = nullptr;
  return {};
}

}  // namespace kiln::sql
