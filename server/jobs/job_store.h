#pragma once
// Where jobs live. One interface, several engines, one conformance suite (tests/server/jobs).
//
// Promise: what create() or commit() reported survives kill -9 and power loss. A job runs at least once; its result
// becomes visible exactly once, because every write of a worker names its claim (token and fence) and touches nothing
// when the job was given away, canceled or removed meanwhile.
// All times are the store's own clock. Every function may be called from any thread.

#include <chrono>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/jobs/event.h"
#include "server/jobs/job.h"

namespace kiln {

using Millis = std::chrono::milliseconds;

struct NewJob {
  std::string tenant;
  std::string label;
  JobInputs inputs;
  std::string recipe;
  std::string content_key;
  bool force = false;           // do not answer from an earlier result
  std::string idempotency_key;  // the tenant's own; empty: none
  std::string request_hash;     // of the whole request; a key met again with another hash is refused
  int max_queued = 0;           // refuse with "queue_full" when so many wait already; 0: no limit
  int max_open = 0;             // refuse with "quota" when the tenant has so many queued or running; 0: no limit
  std::uint64_t memory_mb = 0;  // that it may use
};

/// A blob that the store is to know.
struct StoredJournal {
  std::string sha256;
  std::uint64_t bytes = 0;
};

struct Created {
  Job job;
  bool existed = false;  // the idempotency key was known: `job` is the first one
};

/// The right to write to a running job. Dies when the lease ends or the job is canceled.
struct ClaimRef {
  std::string job_id;
  std::string token;       // 128 random bits, hex
  std::int64_t fence = 0;  // grows with every claim of the store
};

struct Claim {
  ClaimRef ref;
  Job job;
};

/// Who claims, and what he can take.
struct Taker {
  std::string maker;  // whoever has the same word computes the same bits: parts of others are not for him
  std::uint64_t free_mb = std::numeric_limits<std::uint64_t>::max();  // memory not given to jobs yet
  bool idle = true;  // runs nothing: takes the next job, however much memory that may use
  Millis patience{
      30'000};  // smaller jobs overtake one that has no room, until it has waited for so long; parts: always
};

/// Ranges of a loop that a running job gives away.
struct NewParts {
  std::vector<std::string> orders;  // of each range, JSON
  std::string maker;                // see Taker
  StoredJournal journal;
};

struct PartState {
  std::string id, order, maker;
  JobState state = JobState::queued;
  std::string sha256;  // of its result, once succeeded
};

enum class Beat { ok, lost, cancel_requested };
enum class Wrote { done, lost };  // lost: fenced off, canceled or gone; nothing was written

struct JobQuery {
  std::optional<std::string> tenant;
  std::optional<JobState> state;
  std::optional<std::string> label;
  int limit = 50;
  std::string cursor;  // from JobPage::next_cursor; empty for the first page
};

/// Newest first. Jobs created while paging never shift or repeat an entry.
struct JobPage {
  std::vector<Job> jobs;
  std::string next_cursor;  // empty on the last page
};

/// A retry: why, and how long the job rests. `crash` counts against the crash limit, else against the retries.
struct Retry {
  std::string reason;
  bool crash = false;
  Millis delay{0};
};

/// How long jobs that ended are kept; 0: for ever.
struct Retention {
  Millis others{0};                       // of tenants that are not among
  std::map<std::string, Millis> tenants;  // these
};

struct StoreCounts {
  std::uint64_t queued = 0, running = 0, succeeded = 0, failed = 0, canceled = 0;
  std::uint64_t pinned = 0;
  std::int64_t oldest_queued_ms = 0;  // creation time; 0 when nothing waits
  std::uint64_t deliveries = 0;       // messages that still have to reach somebody (delivery.h)
};

/// Held from making a blob until a row refers to it, or alone while the bytes of forgotten blobs are removed: so that
/// bytes which come again meanwhile are not taken away.
class BlobGate {
 public:
  virtual ~BlobGate() = default;
};

class DeliveryQueue;  // delivery.h

/// Codes of faults: store_failed, store_unavailable (no connection to the database now: try again), disk_full (the
/// database cannot grow), not_found, bad_cursor, queue_full, quota, idempotency_mismatch, asset_not_found, poisoned
/// (the same content crashed its worker twice within 24 h), not_terminal, pinned, daily_quota.
class JobStore {
 public:
  virtual ~JobStore() = default;

  /// Stores a job; at once `succeeded` and `cached` when content_key has a result and not `force`.
  /// Every input must be a blob that the tenant brought or baked (touch_blob, commit).
  virtual Result<Created> create(const NewJob&) = 0;

  /// A job that is due, now running under a lease; nothing when none is, or none that the taker has room for. Of the
  /// tenant with the fewest running jobs the oldest; parts come after jobs, since these go on without help.
  virtual Result<std::optional<Claim>> claim(Millis lease, const Taker&) = 0;
  virtual Result<Beat> heartbeat(const ClaimRef&, Millis lease, const std::optional<JobProgress>&) = 0;
  virtual Result<Wrote> commit(const ClaimRef&, std::span<const Artifact>, bool cached) = 0;
  virtual Result<Wrote> fail(const ClaimRef&, const JobError&) = 0;
  virtual Result<Wrote> retry(const ClaimRef&, const Retry&) = 0;
  /// Back to the queue without losing an attempt (drain).
  virtual Result<Wrote> release(const ClaimRef&) = 0;
  /// Ends a running job whose cancellation was asked for, once its worker is gone.
  virtual Result<Wrote> finish_cancel(const ClaimRef&) = 0;

  /// Gives ranges of a running job away, as jobs of their own with its inputs and recipe. They are nobody's business:
  /// in no list, count, quota or stream of all events. When the job ends they go, running or not.
  virtual Result<Wrote> add_parts(const ClaimRef& parent, const NewParts&) = 0;
  /// What became of them, oldest first.
  virtual Result<std::vector<PartState>> parts(const std::string& parent) = 0;
  /// The job goes on where they are of no use. Those of a job that is another's now stay.
  virtual Result<void> forget_parts(const ClaimRef& parent) = 0;
  /// This one, for the job itself to compute; nothing when it does not wait any more.
  virtual Result<std::optional<Claim>> claim_part(const std::string& id, Millis lease) = 0;

  /// Requeues (or cancels, when asked for) jobs whose lease ended; with `everything` all running ones. Returns how
  /// many.
  virtual Result<int> reap(bool everything = false) = 0;

  /// queued -> canceled at once; running -> flagged; terminal -> unchanged. Returns the job after it.
  virtual Result<Job> cancel(const std::string& id) = 0;
  /// Forgets a terminal job and its events, unless it is "pinned". Removing an unknown job is done already.
  virtual Result<void> remove(const std::string& id) = 0;
  /// A pinned job is kept, with its inputs and artefacts, whatever its age. Returns the job after it.
  virtual Result<Job> pin(const std::string& id, bool pinned) = 0;
  /// Forgets jobs that ended longer ago than their tenant keeps them, unless they are pinned. Returns how many; with
  /// `only_count` how many it would be.
  virtual Result<int> forget_old_jobs(const Retention&, bool only_count = false) = 0;

  virtual Result<Job> get(const std::string& id) = 0;
  virtual Result<JobPage> list(const JobQuery&) = 0;
  /// Artefacts of an earlier success with this key; empty when there is none.
  virtual Result<std::vector<Artifact>> find_result(const std::string& content_key) = 0;
  virtual Result<StoreCounts> counts() = 0;
  /// How long until the next waiting job is due; nothing when no job waits for its time.
  virtual Result<std::optional<Millis>> next_due() = 0;

  /// Durable events with id > `after`, oldest first; of one job, or of all when `job_id` is empty.
  virtual Result<std::vector<JobEvent>> events_after(std::uint64_t after, const std::string& job_id, int limit) = 0;
  virtual Result<std::uint64_t> last_event_id() = 0;
  virtual Result<void> log(const std::string& job_id, const std::string& line) = 0;

  /// Notes that a blob exists, that the tenant has it, and that it was just referred to. Call after it is durable.
  /// Without a tenant nobody has it who had it not before.
  virtual Result<void> touch_blob(const std::string& sha256, std::uint64_t bytes,
                                  const std::optional<std::string>& tenant = "") = 0;
  /// Whether the tenant has the blob; without one: whether anybody has.
  virtual Result<bool> knows_blob(const std::string& sha256, const std::optional<std::string>& tenant = {}) = 0;
  /// A blob that a tenant pinned is kept whether a job needs it or not. "not_found" when the tenant has none.
  virtual Result<void> pin_blob(const std::string& sha256, const std::string& tenant, bool pinned) = 0;
  /// Forgets blobs that nothing refers to, nobody pinned and nobody touched for `grace`, and returns them: their files
  /// may go now. With `only_count` they stay.
  virtual Result<std::vector<std::string>> forget_unused_blobs(Millis grace, bool only_count = false) = 0;

  /// Adds to what the tenant uploaded today (UTC, the store's day). "daily_quota", and nothing added, when that would
  /// be more than `limit` (0: none). The day, counted from 1970.
  virtual Result<std::int64_t> charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) = 0;
  /// Takes back what was charged on that day and did not come.
  virtual Result<void> refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) = 0;

  /// Among those who make blobs; waits while somebody removes some.
  virtual Result<std::unique_ptr<BlobGate>> enter_blob_gate() = 0;
  /// Alone. "gate_busy" when others stay too long: try again later.
  virtual Result<std::unique_ptr<BlobGate>> close_blob_gate() = 0;

  /// Messages that wait for their receivers.
  virtual DeliveryQueue& deliveries() = 0;

  /// Other programs write to this store as well: only the end of a lease tells that a worker is gone.
  virtual bool shared() const = 0;
  /// `wake` is called soon after another program wrote. A hint that may get lost: look every few seconds all the same.
  /// An empty one ends it: no call is under way when this returns.
  virtual void on_change(std::function<void()> wake) = 0;

  /// Who this store is, for ever: 32 hex digits, drawn when its tables were made.
  virtual Result<std::string> identity() = 0;
  /// Writes and reads back one row: ready to serve.
  virtual Result<void> check_writable() = 0;
};

}  // namespace kiln
