#pragma once
// The whole service behind one door: submit, watch, cancel, fetch. The HTTP front talks to this and to nothing below.
//
// Fault codes and the status a front gives them:
//   400 bad_cursor            404 not_found                 409 upload_busy, offset_mismatch, not_terminal, pinned
//   422 asset_not_found, idempotency_mismatch, hash_mismatch, poisoned, and every fault of an input (plan, jobs)
//   429 queue_full, quota, daily_quota, plan_busy      503 draining             507 disk_full          500
//   store_failed, io_failed, internal
// Every function may be called from any thread. Those with a timeout block their caller for at most that long.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/bake/recipe.h"
#include "core/base/durations.h"
#include "server/blobs/blob_store.h"
#include "server/jobs/job_store.h"
#include "server/webhooks/webhooks.h"
#include "server/work/sandbox.h"
#include "server/work/stores.h"
#include "server/work/upload_desk.h"
#include "server/work/worker_protocol.h"

namespace kiln {

struct ServiceOptions {
  std::filesystem::path data;               // of this server alone: work/, checkpoints/, lock; kiln.db, cas/, tmp/
  StoreOptions stores;                      // where jobs and blobs live when not in `data`
  int workers = 1;                          // jobs at a time, each in a process of its own; 0: bake nothing
  int threads = 0;                          // of one worker when its recipe does not say; 0: hardware threads / workers
  std::uint64_t memory_mb = 0;              // that running jobs may declare together; 0: machine_memory.h
  Sharing sharing{.least_s = 10};           // of bakes, where there are other workers
  std::vector<std::string> worker_command;  // empty: this very program with "bake-worker"
  int max_queued = 1000;
  double soft_free_fraction = 0.10;  // below: uploads are refused with disk_full
  double hard_free_fraction = 0.05;  // below: nothing is claimed, the queue waits
  Millis blob_grace{24 * 3600 * 1000};
  Retention retention;           // how long jobs that ended are kept
  Millis lease{60'000};          // a job whose server says nothing for so long is given to another
  Millis first_retry{10'000};    // after trouble of the machine: x 4 each time, at most 1 h, 5 times
  WebhookOptions webhooks;       // who is told when jobs end
  bool require_sandbox = false;  // jobs fail where workers cannot lock themselves in (sandbox.h)
};

/// A job or plan to be. All files are blobs already (put_asset).
struct Submission {
  std::optional<std::string> tenant;     // whose the job is to be; none: nobody's, and any tenant's files serve
  int max_open = 0;                      // unfinished jobs that the tenant may have; 0: no limit
  std::string scene_name = "scene.glb";  // for error places
  std::string scene_sha256;              // empty: recipe.scene_asset
  std::vector<NamedBlob> resources;      // by URI as the .gltf writes it, percent-decoded
  std::string environment_name;          // of an asset environment, for error places; empty: its hash
  Recipe recipe;                         // its environment names an asset, a formula or nothing; label included
  bool force = false;
  std::string idempotency_key;
};

struct OpenArtifact {
  Artifact artifact;
  BlobReader reader;
};

/// An upload. write() streams to disk; finish() makes it durable and known. Dropped before: see BlobWriter.
class AssetUpload {
 public:
  virtual ~AssetUpload() = default;
  virtual Result<void> write(std::span<const std::uint8_t> bytes) = 0;
  virtual std::uint64_t bytes() const = 0;
  virtual Result<StoredBlob> finish() = 0;
};

struct AssetRequest {
  std::string sha256;          // what the bytes must hash to; empty: not known
  std::uint64_t offset = 0;    // resume here, see asset_offset(); needs sha256
  std::uint64_t expected = 0;  // bytes to come if known: refused at once when the disk cannot take them
  std::string tenant;          // who brings it
};

/// Events of one job or of all: first those the store kept, then as they happen. Never skips a durable one.
class EventStream {
 public:
  virtual ~EventStream() = default;
  /// The next event; nothing when `timeout` passed (send a heartbeat) or the stream is closed.
  virtual std::optional<JobEvent> next(Millis timeout) = 0;
  /// The service drains: say good-bye.
  virtual bool closed() const = 0;
};

struct ServiceStats {
  StoreCounts jobs;
  std::uint64_t claimed = 0, succeeded = 0, failed = 0, canceled = 0, cached = 0;  // since start
  std::uint64_t parts = 0;  // ranges computed for bakes, here or of other servers
  std::uint64_t retried = 0, reaped = 0, forgotten = 0, lost_leases = 0, stale_commits = 0;
  std::uint64_t deaths_signal = 0, deaths_memory = 0, deaths_timeout = 0;
  std::uint64_t bytes_uploaded = 0;
  WebhookCounts webhooks;
  DurationCounts claim_latency;  // created to claimed
  DurationCounts syncs;          // of blobs and their folders
  Sandbox sandbox;               // what this kernel offers to lock workers in
  double free_fraction = 1;
  std::uint64_t free_bytes = 0;
};

/// One thing that serving needs.
struct Check {
  std::string name;  // store, blobs, disk, sandbox, drain
  bool ready = true;
  std::string state;  // a sentence when not ready, else a word or two
};

class Service {
 public:
  /// Takes the lock ("data_in_use" when another server has it), recovers what an earlier one left, starts nothing yet.
  /// In a fleet the running jobs of others stay theirs: only the end of a lease gives them back.
  static Result<std::unique_ptr<Service>> open(const ServiceOptions&);
  virtual ~Service() = default;

  /// Starts the workers.
  virtual void start() = 0;
  /// Running jobs go back to the queue, streams and waits end. Returns when no worker process is left.
  virtual void drain() = 0;

  /// Durable when it returns. The job has succeeded already (cached) when its result is known.
  virtual Result<Created> submit(const Submission&) = 0;
  /// What a bake would do, as JSON text; runs in a worker process of its own.
  virtual Result<std::string> plan(const Submission&) = 0;

  virtual Result<Job> get(const std::string& id) = 0;
  virtual Result<JobPage> list(const JobQuery&) = 0;
  virtual Result<Job> cancel(const std::string& id) = 0;
  /// Cancels when necessary, then forgets. An unknown job is not_found.
  virtual Result<void> remove(const std::string& id) = 0;
  /// The job as soon as its version differs from `version`, or when the time is over.
  virtual Result<Job> wait_change(const std::string& id, std::uint64_t version, Millis timeout) = 0;
  /// The job as soon as it is terminal, or when the time is over.
  virtual Result<Job> wait_done(const std::string& id, Millis timeout) = 0;

  /// `job_id` empty: all jobs. `after` absent: only what happens from now on; 0: everything the store has.
  virtual Result<std::unique_ptr<EventStream>> subscribe(const std::string& job_id,
                                                         std::optional<std::uint64_t> after) = 0;

  /// What happened to a job, oldest first; of a long story the first kMaxHistory events.
  static constexpr int kMaxHistory = 1000;
  virtual Result<std::vector<JobEvent>> history(const std::string& id) = 0;

  /// A pinned job, or asset (an artefact is one, too), is kept until it is unpinned. Unknown ones are not_found.
  virtual Result<Job> pin(const std::string& id, bool pinned) = 0;
  virtual Result<void> pin_asset(const std::string& sha256, const std::string& tenant, bool pinned) = 0;

  virtual Result<OpenArtifact> open_artifact(const std::string& id, const std::string& name) = 0;
  virtual Result<std::unique_ptr<AssetUpload>> put_asset(const AssetRequest&) = 0;
  /// Whether the tenant has it; without one: whether anybody has. Asking keeps it for a while.
  virtual bool has_asset(const std::string& sha256, const std::optional<std::string>& tenant) = 0;
  /// Where an interrupted upload of `sha256` goes on.
  virtual std::uint64_t asset_offset(const std::string& sha256, const std::string& tenant) = 0;
  virtual Result<BlobReader> open_asset(const std::string& sha256) = 0;

  /// Uploads in pieces; see UploadDesk. `wanted` has length, metadata, and expected if it is known.
  virtual Result<PartialUpload> begin_upload(const PartialUpload& wanted) = 0;
  virtual Result<PartialUpload> find_upload(const std::string& id, const std::string& tenant) = 0;
  virtual Result<std::unique_ptr<UploadPiece>> append_upload(const PartialUpload& id_and_tenant,
                                                             std::uint64_t offset) = 0;
  virtual Result<void> remove_upload(const std::string& id, const std::string& tenant) = 0;

  /// Counts what a tenant uploads a day; see JobStore.
  virtual Result<std::int64_t> charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) = 0;
  virtual Result<void> refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) = 0;

  virtual ServiceStats stats() = 0;
  /// Whether the service can take work, thing by thing.
  virtual std::vector<Check> checks() = 0;
};

}  // namespace kiln
