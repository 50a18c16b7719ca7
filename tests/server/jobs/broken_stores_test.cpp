// The conformance suite must be able to fail: each of these engines breaks one promise, and the suite has to find it.
// Fails when it finds nothing in a broken one, or anything in the sound one.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "server/jobs/delivery.h"
#include "tests/server/jobs/store_conformance.h"

namespace kiln::testing {
namespace {

enum class Flaw {
  none,
  late_commits,      // a commit whose claim is lost counts
  two_owners,        // a job is given out twice
  endless_leases,    // nothing is ever reaped
  deaf_heartbeats,   // whoever beats keeps its job
  forgotten_keys,    // idempotency keys are not looked at
  pages_start_over,  // cursors are not looked at
  events_repeat,     // positions are not looked at
  open_gate,         // nobody is ever alone at the blob gate
  open_doors,        // a tenant sees the blobs of others
  deaf_cancels,      // a running job is not told that it was canceled
  loose_pins,        // what is pinned goes all the same
  free_uploads,      // nobody counts what comes
  greedy_claims,     // nobody looks how much memory is left
  lasting_parts,     // parts are never forgotten
  hasty_deliveries   // one that somebody works on is given to others as well
};

/// Takes for so short a time that the next one takes it too.
class HastyDeliveries final : public DeliveryQueue {
 public:
  explicit HastyDeliveries(DeliveryQueue& queue) : queue_(queue) {}
  Result<DeliveryMark> mark() override { return queue_.mark(); }
  Result<Wrote> add(std::uint64_t from, std::uint64_t to, std::span<const NewDelivery> all, Millis longest) override {
    return queue_.add(from, to, all, longest);
  }
  Result<std::optional<Delivery>> take(const std::string& receiver, Millis) override {
    return queue_.take(receiver, Millis(0));
  }
  Result<void> finish(const Delivery& delivery) override { return queue_.finish(delivery); }
  Result<void> retry(const Delivery& delivery, Millis delay) override { return queue_.retry(delivery, delay); }

 private:
  DeliveryQueue& queue_;
};

/// SQLite, with one flaw on top.
class BrokenStore final : public JobStore {
 public:
  BrokenStore(std::unique_ptr<JobStore> store, Flaw flaw) : store_(std::move(store)), flaw_(flaw) {}

  Result<Created> create(const NewJob& job) override {
    NewJob asked = job;
    if (flaw_ == Flaw::forgotten_keys) asked.idempotency_key.clear();
    return store_->create(asked);
  }
  Result<std::optional<Claim>> claim(Millis lease, const Taker& taker) override {
    if (flaw_ == Flaw::two_owners && last_) return std::exchange(last_, std::nullopt);
    Taker asked = taker;
    asked.idle = asked.idle || flaw_ == Flaw::greedy_claims;
    auto claim = store_->claim(lease, asked);
    if (claim) last_ = *claim;
    return claim;
  }
  Result<Beat> heartbeat(const ClaimRef& ref, Millis lease, const std::optional<JobProgress>& progress) override {
    auto beat = store_->heartbeat(ref, lease, progress);
    return flaw_ == Flaw::deaf_heartbeats ? Beat::ok : beat;
  }
  Result<Wrote> commit(const ClaimRef& ref, std::span<const Artifact> artifacts, bool cached) override {
    auto wrote = store_->commit(ref, artifacts, cached);
    return flaw_ == Flaw::late_commits ? Wrote::done : wrote;
  }
  Result<Wrote> fail(const ClaimRef& ref, const JobError& error) override { return store_->fail(ref, error); }
  Result<Wrote> retry(const ClaimRef& ref, const Retry& retry) override { return store_->retry(ref, retry); }
  Result<Wrote> release(const ClaimRef& ref) override { return store_->release(ref); }
  Result<Wrote> finish_cancel(const ClaimRef& ref) override { return store_->finish_cancel(ref); }
  Result<Wrote> add_parts(const ClaimRef& parent, const NewParts& parts) override {
    return store_->add_parts(parent, parts);
  }
  Result<std::vector<PartState>> parts(const std::string& parent) override { return store_->parts(parent); }
  Result<void> forget_parts(const ClaimRef& parent) override {
    return flaw_ == Flaw::lasting_parts ? Result<void>{} : store_->forget_parts(parent);
  }
  Result<std::optional<Claim>> claim_part(const std::string& id, Millis lease) override {
    return store_->claim_part(id, lease);
  }
  Result<int> reap(bool everything) override { return flaw_ == Flaw::endless_leases ? 0 : store_->reap(everything); }
  Result<Job> cancel(const std::string& id) override {
    return flaw_ == Flaw::deaf_cancels ? store_->get(id) : store_->cancel(id);
  }
  Result<void> remove(const std::string& id) override { return store_->remove(id); }
  Result<Job> get(const std::string& id) override { return store_->get(id); }
  Result<JobPage> list(const JobQuery& query) override {
    JobQuery asked = query;
    if (flaw_ == Flaw::pages_start_over && ++pages_ < 20) asked.cursor.clear();
    return store_->list(asked);
  }
  Result<std::vector<Artifact>> find_result(const std::string& key) override { return store_->find_result(key); }
  Result<StoreCounts> counts() override { return store_->counts(); }
  Result<std::optional<Millis>> next_due() override { return store_->next_due(); }
  Result<std::vector<JobEvent>> events_after(std::uint64_t after, const std::string& id, int limit) override {
    return store_->events_after(flaw_ == Flaw::events_repeat ? 0 : after, id, limit);
  }
  Result<std::uint64_t> last_event_id() override { return store_->last_event_id(); }
  Result<void> log(const std::string& id, const std::string& line) override { return store_->log(id, line); }
  Result<void> touch_blob(const std::string& sha, std::uint64_t bytes,
                          const std::optional<std::string>& tenant) override {
    return store_->touch_blob(sha, bytes, tenant);
  }
  Result<bool> knows_blob(const std::string& sha, const std::optional<std::string>& tenant) override {
    return store_->knows_blob(sha, flaw_ == Flaw::open_doors ? std::nullopt : tenant);
  }
  Result<std::vector<std::string>> forget_unused_blobs(Millis grace, bool only_count) override {
    return store_->forget_unused_blobs(grace, only_count);
  }
  Result<Job> pin(const std::string& id, bool pinned) override {
    return store_->pin(id, pinned && flaw_ != Flaw::loose_pins);
  }
  Result<int> forget_old_jobs(const Retention& retention, bool only_count) override {
    return store_->forget_old_jobs(retention, only_count);
  }
  Result<void> pin_blob(const std::string& sha, const std::string& tenant, bool pinned) override {
    return store_->pin_blob(sha, tenant, pinned);
  }
  Result<std::int64_t> charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) override {
    return store_->charge_upload(tenant, bytes, flaw_ == Flaw::free_uploads ? 0 : limit);
  }
  Result<void> refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) override {
    return store_->refund_upload(tenant, bytes, day);
  }
  Result<std::unique_ptr<BlobGate>> enter_blob_gate() override { return store_->enter_blob_gate(); }
  Result<std::unique_ptr<BlobGate>> close_blob_gate() override {
    return flaw_ == Flaw::open_gate ? store_->enter_blob_gate() : store_->close_blob_gate();
  }
  DeliveryQueue& deliveries() override { return flaw_ == Flaw::hasty_deliveries ? hasty_ : store_->deliveries(); }
  bool shared() const override { return store_->shared(); }
  void on_change(std::function<void()> wake) override { store_->on_change(std::move(wake)); }
  Result<std::string> identity() override { return store_->identity(); }
  Result<void> check_writable() override { return store_->check_writable(); }

 private:
  std::unique_ptr<JobStore> store_;
  Flaw flaw_;
  HastyDeliveries hasty_{store_->deliveries()};
  std::optional<Claim> last_;
  int pages_ = 0;
};

Engine broken(const std::string& name, Flaw flaw) {
  return {name, [flaw](const std::filesystem::path& folder, TestClock& clock) -> std::unique_ptr<JobStore> {
            return std::make_unique<BrokenStore>(open_sqlite_on(folder, clock), flaw);
          }};
}

std::vector<Engine> engines() {
  return {broken("sound", Flaw::none),
          broken("late_commits", Flaw::late_commits),
          broken("two_owners", Flaw::two_owners),
          broken("endless_leases", Flaw::endless_leases),
          broken("deaf_heartbeats", Flaw::deaf_heartbeats),
          broken("forgotten_keys", Flaw::forgotten_keys),
          broken("pages_start_over", Flaw::pages_start_over),
          broken("events_repeat", Flaw::events_repeat),
          broken("open_gate", Flaw::open_gate),
          broken("open_doors", Flaw::open_doors),
          broken("deaf_cancels", Flaw::deaf_cancels),
          broken("loose_pins", Flaw::loose_pins),
          broken("free_uploads", Flaw::free_uploads),
          broken("greedy_claims", Flaw::greedy_claims),
          broken("lasting_parts", Flaw::lasting_parts),
          broken("hasty_deliveries", Flaw::hasty_deliveries)};
}

/// Counts what fails for each engine, and says nothing itself.
class Counter : public ::testing::EmptyTestEventListener {
 public:
  void OnTestEnd(const ::testing::TestInfo& info) override {
    const std::string name = info.name();  // "Sentence/engine"
    failures[name.substr(name.find('/') + 1)] += info.result()->Failed() ? 1 : 0;
  }
  std::map<std::string, int> failures;
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Broken, StoreConformance, ::testing::ValuesIn(engines()), engine_name);
INSTANTIATE_TEST_SUITE_P(Broken, StoreDeliveries, ::testing::ValuesIn(engines()), engine_name);
INSTANTIATE_TEST_SUITE_P(Broken, StoreClaims, ::testing::ValuesIn(engines()), engine_name);

}  // namespace kiln::testing

int main(int argc, char** argv) {
  // An engine that hands the same event or job out for ever would keep these two busy until their time is over.
  GTEST_FLAG_SET(filter, "-*MissesNone*/events_repeat:*MissesNone*/two_owners:*ManyThreads*/two_owners");
  if (std::filesystem::is_directory("/dev/shm")) ::setenv("TMPDIR", "/dev/shm", 1);  // no disk need turn for this
  ::testing::InitGoogleTest(&argc, argv);
  auto& listeners = ::testing::UnitTest::GetInstance()->listeners();
  delete listeners.Release(listeners.default_result_printer());
  kiln::testing::Counter counter;
  listeners.Append(&counter);
  const bool all_passed = RUN_ALL_TESTS() == 0;
  listeners.Release(&counter);
  bool right = !all_passed;
  for (const auto& [engine, failures] : counter.failures) {
    std::printf("%-17s %d tests failed\n", engine.c_str(), failures);
    right = right && (failures > 0) == (engine != "sound");
  }
  return right && counter.failures.size() == kiln::testing::engines().size() ? 0 : 1;
}
