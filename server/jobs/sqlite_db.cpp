#include "server/jobs/sqlite_db.h"

#include <sqlite3.h>

#include <cerrno>
#include <utility>

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

}  // namespace

void CloseStatement::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Result<bool> Rows::next() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return database_fault(sqlite3_db_handle(statement_.get()));
}

bool Rows::is_null(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }
std::int64_t Rows::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
double Rows::real(int column) const { return sqlite3_column_double(statement_.get(), column); }

std::string Rows::text(int column) const {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (bytes == nullptr) return {};
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

void Rows::bind(int index, std::int64_t value) { sqlite3_bind_int64(statement_.get(), index, value); }
void Rows::bind(int index, double value) { sqlite3_bind_double(statement_.get(), index, value); }
void Rows::bind(int index, std::nullptr_t) { sqlite3_bind_null(statement_.get(), index); }
void Rows::bind(int index, std::string_view value) {
  const char* bytes = value.data() == nullptr ? "" : value.data();  // a null pointer would bind NULL
  sqlite3_bind_text64(statement_.get(), index, bytes, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
}

Result<Database> Database::open(const std::filesystem::path& file, Mode mode) {
  sqlite3* handle = nullptr;
  const int access = mode == Mode::read_only ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  const int code = sqlite3_open_v2(file.c_str(), &handle, access | SQLITE_OPEN_NOMUTEX, nullptr);
  Database db(handle);
  if (code != SQLITE_OK) return database_fault(handle);
  sqlite3_extended_result_codes(handle, 0);
  if (mode == Mode::read_only) sqlite3_db_config(handle, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  return db;
}

Database::Database(Database&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
Database::~Database() { sqlite3_close_v2(handle_); }

Result<void> Database::execute(const char* statements) {
  if (sqlite3_exec(handle_, statements, nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return database_fault(handle_);
}

Result<Rows> Database::prepare(const char* statement) {
  sqlite3_stmt* prepared = nullptr;
  if (sqlite3_prepare_v2(handle_, statement, -1, &prepared, nullptr) != SQLITE_OK) return database_fault(handle_);
  return Rows(prepared);
}

int Database::changes() const { return sqlite3_changes(handle_); }
std::int64_t Database::last_insert_id() const { return sqlite3_last_insert_rowid(handle_); }

Result<Transaction> Transaction::begin(Database& db) {
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
