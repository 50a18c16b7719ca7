#pragma once
// Connections that are kept for the next user, and the one that listens. Internal to server/jobs.

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/jobs/postgres_db.h"

namespace kiln::sql {

/// At most `most` connections. After one could not be made, nobody tries for a while (0.1 s, twice as long each time,
/// up to 5 s): callers hear "store_unavailable" at once instead of waiting one behind the other.
class PostgresPool {
 public:
  PostgresPool(PostgresOptions options, int most) : options_(std::move(options)), free_(most) {}

  /// A connection until the end of its holder; one that broke, or sits in a transaction, is not kept.
  class Held {
   public:
    Held(PostgresPool& pool, std::unique_ptr<PostgresConnection> connection)
        : pool_(&pool), connection_(std::move(connection)) {}
    Held(Held&&) noexcept = default;
    Held& operator=(Held&&) = delete;
    ~Held();
    PostgresConnection& operator*() const { return *connection_; }
    PostgresConnection* operator->() const { return connection_.get(); }

   private:
    PostgresPool* pool_;
    std::unique_ptr<PostgresConnection> connection_;
  };
  /// Waits for a free one. `fresh`: a new connection, since one that was kept turned out to be dead.
  Result<Held> take(bool fresh = false);

 private:
  using Clock = std::chrono::steady_clock;
  Result<std::unique_ptr<PostgresConnection>> connect();
  void give_back(std::unique_ptr<PostgresConnection>);

  const PostgresOptions options_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<PostgresConnection>> kept_;
  int free_;
  Clock::time_point next_try_{};
  Millis pause_{0};
};

/// Calls `wake` when another program wrote, and after each new connection, since notices may have been missed.
class PostgresListener {
 public:
  PostgresListener(PostgresOptions options, std::function<void()> wake);
  PostgresListener(const PostgresListener&) = delete;
  PostgresListener& operator=(const PostgresListener&) = delete;
  ~PostgresListener();

 private:
  void work();
  void listen(PostgresConnection&);
  bool wait(int descriptor, Millis at_most) const;  // false when it is time to end
  const PostgresOptions options_;
  const std::function<void()> wake_;
  int stop_;  // an eventfd
  std::thread thread_;
};

}  // namespace kiln::sql
