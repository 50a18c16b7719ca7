#pragma once
// A connection to SQLite. Internal to server/jobs.

#include <filesystem>
#include <functional>

#include "server/jobs/sql.h"

struct sqlite3;

namespace kiln::sql {

class SqliteConnection final : public Connection {
 public:
  enum class Mode { read_write, read_only };
  static Result<std::unique_ptr<SqliteConnection>> open(const std::filesystem::path& file, Mode mode,
                                                        std::function<std::int64_t()> now_ms);
  SqliteConnection(const SqliteConnection&) = delete;
  SqliteConnection& operator=(const SqliteConnection&) = delete;
  ~SqliteConnection() override;

  Result<Rows> ask(const std::string& statement, const std::vector<Value>& values) override;
  Result<std::int64_t> now_ms() override { return now_ms_(); }
  /// Runs statements without values or rows.
  Result<void> execute(const std::string& statements);

 private:
  SqliteConnection(sqlite3* handle, std::function<std::int64_t()> now_ms)
      : handle_(handle), now_ms_(std::move(now_ms)) {}
  sqlite3* handle_;
  std::function<std::int64_t()> now_ms_;
};

/// BEGIN IMMEDIATE now; ROLLBACK at the end unless committed.
class Transaction {
 public:
  static Result<Transaction> begin(SqliteConnection&);
  Transaction(Transaction&& other) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();
  Result<void> commit();

 private:
  explicit Transaction(SqliteConnection& db) : db_(&db) {}
  SqliteConnection* db_;  // null once over
};

}  // namespace kiln::sql
