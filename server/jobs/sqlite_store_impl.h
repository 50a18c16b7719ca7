#pragma once
// The store's class, shared by the files that each hold one group of its functions. Internal to server/jobs.

#include <functional>
#include <mutex>
#include <utility>

#include "server/jobs/ids.h"
#include "server/jobs/job_store.h"
#include "server/jobs/sqlite_db.h"
#include "server/jobs/sqlite_rows.h"
#include "server/jobs/sqlite_store.h"

namespace kiln::sql {

/// Invariants: every write runs in one IMMEDIATE transaction on writer_ under write_mutex_; reader_ only reads.
class SqliteStore final : public JobStore {
 public:
  SqliteStore(Database writer, Database reader, std::function<std::int64_t()> now_ms)
      : writer_(std::move(writer)), reader_(std::move(reader)), now_ms_(std::move(now_ms)) {}

  Result<Created> create(const NewJob&) override;

  Result<std::optional<Claim>> claim(Millis lease) override;
  Result<Beat> heartbeat(const ClaimRef&, Millis lease, const std::optional<JobProgress>&) override;
  Result<Wrote> commit(const ClaimRef&, std::span<const Artifact>, bool cached) override;
  Result<Wrote> fail(const ClaimRef&, const JobError&) override;
  Result<Wrote> retry(const ClaimRef&, const Retry&) override;
  Result<Wrote> release(const ClaimRef&) override;
  Result<Wrote> finish_cancel(const ClaimRef&) override;
  Result<int> reap(bool everything) override;

  Result<Job> cancel(const std::string& id) override;
  Result<void> remove(const std::string& id) override;

  Result<Job> get(const std::string& id) override;
  Result<JobPage> list(const JobQuery&) override;
  Result<std::vector<Artifact>> find_result(const std::string& content_key) override;
  Result<StoreCounts> counts() override;
  Result<std::optional<Millis>> next_due() override;
  Result<std::vector<JobEvent>> events_after(std::uint64_t after, const std::string& job_id, int limit) override;
  Result<std::uint64_t> last_event_id() override;

  Result<void> log(const std::string& job_id, const std::string& line) override;
  Result<void> touch_blob(const std::string& sha256, std::uint64_t bytes) override;
  Result<bool> knows_blob(const std::string& sha256) override;
  Result<std::vector<std::string>> forget_unused_blobs(Millis grace) override;
  Result<void> check_writable() override;

 private:
  /// Runs body(now) in one transaction; what it wrote is durable when a value comes back.
  template <class Body>
  auto write(Body&& body) -> decltype(body(std::int64_t{})) {
    const std::lock_guard lock(write_mutex_);
    KILN_TRY(transaction, Transaction::begin(writer_));
    auto result = body(now_ms_());
    if (!result) return result;
    KILN_DO(transaction.commit());
    return result;
  }
  template <class Body>
  auto read(Body&& body) -> decltype(body()) {
    const std::lock_guard lock(read_mutex_);
    return body();
  }

  Result<std::optional<Created>> find_idempotent(const NewJob&);
  Result<void> refer_to_inputs(const JobInputs&, std::int64_t now);
  Result<void> refuse_poison(const NewJob&, std::int64_t now);
  Result<void> refuse_full_queue(int max_queued);
  Result<void> insert_job(const Job&, const NewJob&, std::int64_t now);
  Result<void> append_success(const std::string& job_id, std::span<const Artifact>, std::int64_t now);
  Result<Wrote> requeue(const ClaimRef&, const Retry&, const char* counters);
  Result<void> reap_one(const std::string& id, std::int64_t now);

  std::mutex write_mutex_, read_mutex_;
  Database writer_, reader_;
  std::function<std::int64_t()> now_ms_;
  UlidGenerator ids_;  // under write_mutex_
};

/// Artefacts of the newest success with this key.
Result<std::vector<Artifact>> find_result_in(Database&, const std::string& content_key);

}  // namespace kiln::sql
