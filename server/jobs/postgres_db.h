#pragma once
// A connection to PostgreSQL through libpq. Internal to server/jobs.

#include <functional>
#include <string>

#include "server/jobs/postgres_store.h"
#include "server/jobs/sql.h"

struct pg_conn;
struct pg_result;

namespace kiln::sql {

/// What the last failed statement calls for.
enum class Trouble {
  none,
  again,  // others were in the way (deadlock, a key that came at the same moment): the same work may succeed now
  lost,   // the connection is gone
  other
};

class PostgresConnection final : public Connection {
 public:
  static Result<std::unique_ptr<PostgresConnection>> open(const PostgresOptions&);
  PostgresConnection(const PostgresConnection&) = delete;
  PostgresConnection& operator=(const PostgresConnection&) = delete;
  ~PostgresConnection() override;

  Result<Rows> ask(const std::string& statement, const std::vector<Value>& values) override;
  Result<std::int64_t> now_ms() override;
  /// Runs statements without values or rows.
  Result<void> execute(const std::string& statements);

  Trouble trouble() const { return trouble_; }
  void note(Trouble trouble) { trouble_ = trouble; }
  /// Fit for the next user: alive, and no transaction is open.
  bool idle() const;
  /// Takes what the server sent by itself; true when it was a notice. Fails with "store_unavailable".
  Result<bool> take_notices();
  int descriptor() const;

 private:
  struct Clear {
    void operator()(pg_result*) const;
  };
  using Answer = std::unique_ptr<pg_result, Clear>;
  PostgresConnection(pg_conn* handle, std::function<std::int64_t()> now_ms)
      : handle_(handle), now_ms_(std::move(now_ms)) {}
  Result<void> check_settings();
  Result<Answer> wait_answer();
  Result<bool> wait_ready();
  tl::unexpected<Fault> lost();
  tl::unexpected<Fault> failed(const pg_result*);

  pg_conn* handle_;
  std::function<std::int64_t()> now_ms_;
  Trouble trouble_ = Trouble::none;
};

}  // namespace kiln::sql
