#pragma once
// The little of SQL that the store needs, whatever the database: statements with bound values, rows in memory, faults
// instead of codes, one transaction per write. Internal to server/jobs.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "server/jobs/job_store.h"

/// Leaves the function with the fault of `expr` if there is one.
#define KILN_DO(expr) \
  if (auto done_or_fault = (expr); !done_or_fault) return tl::make_unexpected(done_or_fault.error())

namespace kiln::sql {

using Value = std::variant<std::nullptr_t, std::int64_t, double, std::string>;

template <class T>
Value value_of(const T& value) {
  if constexpr (std::is_same_v<T, std::nullptr_t>) {
    return nullptr;
  } else if constexpr (std::is_floating_point_v<T>) {
    return static_cast<double>(value);
  } else if constexpr (std::is_integral_v<T>) {
    return static_cast<std::int64_t>(value);
  } else {
    return std::string(std::string_view(value));
  }
}

/// Columns count from 0. NULL reads as 0 or empty.
class Row {
 public:
  explicit Row(std::vector<Value> cells) : cells_(std::move(cells)) {}
  bool is_null(std::size_t column) const { return std::holds_alternative<std::nullptr_t>(cells_[column]); }
  std::int64_t integer(std::size_t column) const;
  double real(std::size_t column) const;
  std::string text(std::size_t column) const;

 private:
  std::vector<Value> cells_;
};

struct Rows {
  std::vector<Row> all;
  int changed = 0;  // rows that the statement inserted, updated or deleted
  bool empty() const { return all.empty(); }
  const Row& front() const { return all.front(); }
  auto begin() const { return all.begin(); }
  auto end() const { return all.end(); }
};

class Connection {
 public:
  virtual ~Connection() = default;
  /// Runs one statement; each `?` in it takes the next value.
  virtual Result<Rows> ask(const std::string& statement, const std::vector<Value>& values) = 0;
  /// The store's clock.
  virtual Result<std::int64_t> now_ms() = 0;

  template <class... Values>
  Result<Rows> query(const std::string& statement, const Values&... values) {
    return ask(statement, {value_of(values)...});
  }
  /// Runs one statement and returns how many rows it changed.
  template <class... Values>
  Result<int> run(const std::string& statement, const Values&... values) {
    KILN_TRY(rows, query(statement, values...));
    return rows.changed;
  }
};

/// How a store reaches its database.
class Engine {
 public:
  using Work = std::function<Result<void>(Connection&)>;
  virtual ~Engine() = default;
  /// Runs the work in one transaction: all of it is durable when this succeeds, and nothing of it happened when it
  /// does not, but for a connection that breaks while it commits. The work may run more than once.
  virtual Result<void> write(const Work&) = 0;
  virtual Result<void> read(const Work&) = 0;

  /// What a SELECT ends with to keep the rows until the transaction ends; `skip`: passing over rows that others keep.
  virtual const char* keep_rows(bool skip) const = 0;
  virtual Result<std::unique_ptr<BlobGate>> blob_gate(bool alone) = 0;
  virtual bool shared() const = 0;
  virtual void on_change(std::function<void()>) = 0;
};

}  // namespace kiln::sql
