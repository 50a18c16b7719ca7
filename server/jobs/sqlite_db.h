#pragma once
// The little of SQLite that the store needs: a connection, statements with bound values, faults instead of codes.
// Internal to server/jobs.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

/// Leaves the function with the fault of `expr` if there is one.
#define KILN_DO(expr) \
  if (auto done_or_fault = (expr); !done_or_fault) return tl::make_unexpected(done_or_fault.error())

namespace kiln::sql {

struct CloseStatement {
  void operator()(sqlite3_stmt*) const;
};

/// A prepared statement with its values bound. Columns count from 0.
class Rows {
 public:
  explicit Rows(sqlite3_stmt* statement) : statement_(statement) {}
  /// Moves to the next row; false after the last.
  Result<bool> next();
  bool is_null(int column) const;
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;

  void bind(int index, std::int64_t value);
  void bind(int index, double value);
  void bind(int index, std::string_view value);
  void bind(int index, std::nullptr_t);

 private:
  std::unique_ptr<sqlite3_stmt, CloseStatement> statement_;
};

class Database {
 public:
  enum class Mode { read_write, read_only };
  static Result<Database> open(const std::filesystem::path& file, Mode mode);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) = delete;
  ~Database();

  /// Runs statements without values or rows.
  Result<void> execute(const char* statements);

  template <class... Values>
  Result<Rows> query(const char* statement, const Values&... values) {
    KILN_TRY(rows, prepare(statement));
    int index = 0;
    (bind_value(rows, ++index, values), ...);
    return rows;
  }

  /// Runs one statement and returns how many rows it changed.
  template <class... Values>
  Result<int> run(const char* statement, const Values&... values) {
    KILN_TRY(rows, query(statement, values...));
    KILN_DO(rows.next());
    return changes();
  }

  std::int64_t last_insert_id() const;

 private:
  explicit Database(sqlite3* handle) : handle_(handle) {}
  Result<Rows> prepare(const char* statement);
  int changes() const;

  template <class T>
  static void bind_value(Rows& rows, int index, const T& value) {
    if constexpr (std::is_same_v<T, std::nullptr_t>) {
      rows.bind(index, nullptr);
    } else if constexpr (std::is_floating_point_v<T>) {
      rows.bind(index, static_cast<double>(value));
    } else if constexpr (std::is_integral_v<T>) {
      rows.bind(index, static_cast<std::int64_t>(value));
    } else {
      rows.bind(index, std::string_view(value));
    }
  }

  sqlite3* handle_;
};

/// BEGIN IMMEDIATE now; ROLLBACK at the end unless committed.
class Transaction {
 public:
  static Result<Transaction> begin(Database&);
  Transaction(Transaction&& other) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();
  Result<void> commit();

 private:
  explicit Transaction(Database& db) : db_(&db) {}
  Database* db_;  // null once over
};

}  // namespace kiln::sql
