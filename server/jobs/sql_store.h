#pragma once
// The store over any database that speaks SQL: the rules of job_store.h, once. Shared by the files that each hold one
// group of its functions. Internal to server/jobs.

#include <mutex>
#include <optional>
#include <utility>

#include "server/jobs/ids.h"
#include "server/jobs/job_store.h"
#include "server/jobs/sql.h"
#include "server/jobs/sql_deliveries.h"
#include "server/jobs/sql_rows.h"

namespace kiln::sql {

class SqlStore final : public JobStore {
 public:
  explicit SqlStore(std::unique_ptr<Engine> engine) : engine_(std::move(engine)) {}

  Result<Created> create(const NewJob&) override;

  Result<std::optional<Claim>> claim(Millis lease, const Taker&) override;
  Result<Beat> heartbeat(const ClaimRef&, Millis lease, const std::optional<JobProgress>&) override;
  Result<Wrote> commit(const ClaimRef&, std::span<const Artifact>, bool cached) override;
  Result<Wrote> fail(const ClaimRef&, const JobError&) override;
  Result<Wrote> retry(const ClaimRef&, const Retry&) override;
  Result<Wrote> release(const ClaimRef&) override;
  Result<Wrote> finish_cancel(const ClaimRef&) override;
  Result<Wrote> add_parts(const ClaimRef& parent, const NewParts&) override;
  Result<std::vector<PartState>> parts(const std::string& parent) override;
  Result<void> forget_parts(const ClaimRef& parent) override;
  Result<std::optional<Claim>> claim_part(const std::string& id, Millis lease) override;
  Result<int> reap(bool everything) override;

  Result<Job> cancel(const std::string& id) override;
  Result<void> remove(const std::string& id) override;
  Result<Job> pin(const std::string& id, bool pinned) override;
  Result<int> forget_old_jobs(const Retention&, bool only_count) override;

  Result<Job> get(const std::string& id) override;
  Result<JobPage> list(const JobQuery&) override;
  Result<std::vector<Artifact>> find_result(const std::string& content_key) override;
  Result<StoreCounts> counts() override;
  Result<std::optional<Millis>> next_due() override;
  Result<std::vector<JobEvent>> events_after(std::uint64_t after, const std::string& job_id, int limit) override;
  Result<std::uint64_t> last_event_id() override;

  Result<void> log(const std::string& job_id, const std::string& line) override;
  Result<void> touch_blob(const std::string& sha256, std::uint64_t bytes,
                          const std::optional<std::string>& tenant) override;
  Result<bool> knows_blob(const std::string& sha256, const std::optional<std::string>& tenant) override;
  Result<void> pin_blob(const std::string& sha256, const std::string& tenant, bool pinned) override;
  Result<std::vector<std::string>> forget_unused_blobs(Millis grace, bool only_count) override;
  Result<std::int64_t> charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) override;
  Result<void> refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) override;
  Result<std::string> identity() override;
  Result<void> check_writable() override;

  Result<std::unique_ptr<BlobGate>> enter_blob_gate() override { return engine_->blob_gate(false); }
  Result<std::unique_ptr<BlobGate>> close_blob_gate() override { return engine_->blob_gate(true); }
  DeliveryQueue& deliveries() override { return deliveries_; }
  bool shared() const override { return engine_->shared(); }
  void on_change(std::function<void()> wake) override { engine_->on_change(std::move(wake)); }

 private:
  /// Runs body(connection, now) in one transaction; what it wrote is durable when a value comes back.
  template <class Body>
  auto write(Body&& body) -> decltype(body(std::declval<Connection&>(), std::int64_t{})) {
    std::optional<decltype(body(std::declval<Connection&>(), std::int64_t{}))> result;
    KILN_DO(engine_->write([&](Connection& db) -> Result<void> {
      KILN_TRY(now, db.now_ms());
      result = body(db, now);
      KILN_DO(*result);
      return {};
    }));
    return std::move(*result);
  }
  template <class Body>
  auto read(Body&& body) -> decltype(body(std::declval<Connection&>())) {
    std::optional<decltype(body(std::declval<Connection&>()))> result;
    KILN_DO(engine_->read([&](Connection& db) -> Result<void> {
      result = body(db);
      KILN_DO(*result);
      return {};
    }));
    return std::move(*result);
  }

  /// The queued job is running now, under a new claim.
  Result<Claim> take(Connection&, const std::string& id, Millis lease, std::int64_t now);
  Result<Wrote> requeue(const ClaimRef&, const Retry&, const char* counters);

  std::unique_ptr<Engine> engine_;
  SqlDeliveries deliveries_{*engine_};
  std::mutex ids_mutex_;
  UlidGenerator ids_;
};

/// Artefacts of the newest success with this key.
Result<std::vector<Artifact>> find_result_in(Connection&, const std::string& content_key);
/// The blob exists, the tenant has it (if there is one), and it was referred to now.
struct BlobNote {
  std::string sha256;
  std::uint64_t bytes = 0;
  std::optional<std::string> tenant;
};
Result<void> note_blob(Connection&, const BlobNote&, std::int64_t now_ms);

}  // namespace kiln::sql
