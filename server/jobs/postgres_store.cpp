#include "server/jobs/postgres_store.h"

#include <thread>

#include "server/jobs/postgres_pool.h"
#include "server/jobs/postgres_schema.h"
#include "server/jobs/sql_store.h"

namespace kiln {
namespace {

using sql::PostgresPool;
using sql::Trouble;

constexpr int kConnections = 8;  // of one program; workers and requests share them
constexpr int kGates = 16;       // connections that hold a lock while a blob is made; apart, so that both never wait
constexpr int kTries = 6;

/// An advisory lock for as long as its connection is held.
class LockedGate final : public BlobGate {
 public:
  LockedGate(PostgresPool::Held connection, const char* unlock) : connection_(std::move(connection)), unlock_(unlock) {}
  ~LockedGate() override { static_cast<void>(connection_->execute(unlock_)); }

 private:
  PostgresPool::Held connection_;
  const char* unlock_;
};

class PostgresEngine final : public sql::Engine {
 public:
  explicit PostgresEngine(PostgresOptions options)
      : options_(std::move(options)), connections_(options_, kConnections), gates_(options_, kGates) {}

  Result<void> write(const Work& work) override { return run(work, true); }
  Result<void> read(const Work& work) override { return run(work, false); }
  const char* keep_rows(bool skip) const override { return skip ? " FOR UPDATE SKIP LOCKED" : " FOR UPDATE"; }
  bool shared() const override { return true; }
  void on_change(std::function<void()> wake) override {
    listener_.reset();
    if (wake) listener_ = std::make_unique<sql::PostgresListener>(options_, std::move(wake));
  }

  Result<std::unique_ptr<BlobGate>> blob_gate(bool alone) override {
    KILN_TRY(connection, gates_.take());
    const char* lock =
        alone ? "SELECT pg_advisory_lock(1802071150, 2)" : "SELECT pg_advisory_lock_shared(1802071150, 2)";
    if (auto locked = connection->execute(lock); !locked) {
      if (alone && connection->trouble() == Trouble::other) return fault("gate_busy", "blobs are being made");
      return tl::make_unexpected(locked.error());
    }
    return std::make_unique<LockedGate>(std::move(connection), alone
                                                                   ? "SELECT pg_advisory_unlock(1802071150, 2)"
                                                                   : "SELECT pg_advisory_unlock_shared(1802071150, 2)");
  }

 private:
  /// Again while others were in the way, and once when a kept connection turned out to be dead.
  Result<void> run(const Work& work, bool transaction) {
    bool fresh = false;
    for (int attempt = 1;; ++attempt) {
      KILN_TRY(connection, connections_.take(fresh));
      bool committing = false;
      auto done = transaction ? transact(*connection, work, committing) : work(*connection);
      const Trouble trouble = connection->trouble();
      if (done || committing || attempt == kTries) return done;
      if (trouble == Trouble::lost && !fresh) {
        fresh = true;
      } else if (trouble == Trouble::again) {
        std::this_thread::sleep_for(Millis(5 * attempt));
      } else {
        return done;
      }
    }
  }

  /// A fault of the work itself leaves no trouble behind, and is final.
  static Result<void> transact(sql::PostgresConnection& connection, const Work& work, bool& committing) {
    KILN_DO(connection.execute("BEGIN"));
    auto done = work(connection);
    if (!done) {
      const Trouble trouble = connection.trouble();
      if (trouble != Trouble::lost) static_cast<void>(connection.execute("ROLLBACK"));
      connection.note(trouble);
      return done;
    }
    committing = true;  // from here on, a broken connection leaves open what happened
    return connection.execute("COMMIT");
  }

  const PostgresOptions options_;
  PostgresPool connections_, gates_;
  std::unique_ptr<sql::PostgresListener> listener_;
};

}  // namespace

Result<std::unique_ptr<JobStore>> open_postgres_store(const PostgresOptions& options) {
  KILN_TRY(connection, sql::PostgresConnection::open(options));
  KILN_DO(sql::make_postgres_tables(*connection));
  return std::make_unique<sql::SqlStore>(std::make_unique<PostgresEngine>(options));
}

}  // namespace kiln
