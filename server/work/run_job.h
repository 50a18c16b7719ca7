#pragma once
// One claim from start to its end in the store.

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/durations.h"
#include "server/blobs/blob_store.h"
#include "server/jobs/job_store.h"
#include "server/work/event_bus.h"
#include "server/work/run_worker.h"

namespace kiln {

struct WorkCounters {
  std::atomic<std::uint64_t> claimed{0}, succeeded{0}, failed{0}, canceled{0}, cached{0};
  std::atomic<std::uint64_t> retried{0}, reaped{0}, forgotten{0}, lost_leases{0}, stale_commits{0};
  std::atomic<std::uint64_t> parts{0};  // ranges computed for others' bakes
  std::atomic<std::uint64_t> deaths_signal{0}, deaths_memory{0}, deaths_timeout{0};
  std::atomic<std::uint64_t> bytes_uploaded{0};
  Durations claim_latency;
};

struct WorkOptions {
  std::filesystem::path folder;             // <data>/work
  std::filesystem::path checkpoints;        // <data>/checkpoints
  std::vector<std::string> worker_command;  // see WorkerStart
  int threads = 1;                          // when the recipe does not say
  Millis first_retry{10'000};
  Millis lease{60'000};  // how long the store waits for a word of a running job's server
  bool require_sandbox = false;
  double soft_free_fraction = 0;  // of the disk of the blobs; below: no journal is stored
  Sharing sharing;
};

/// What all of the work shares.
struct WorkPlace {
  JobStore& store;
  BlobStore& blobs;
  EventBus& bus;
  WorkCounters& counters;
  const WorkOptions& options;
};

inline constexpr int kMaxRetries = 5;  // after trouble of the machine
inline constexpr int kMaxCrashes = 2;  // the second crash is the input's own

/// 10 s x 4^n with up to 25 % jitter, at most an hour (for first = 10 s).
Millis retry_delay(Millis first, int retries, double jitter);

/// Runs the job's worker and writes how it ended. When asked to drain, the job goes back to the queue.
void run_job(const Claim&, StopSignal&, const WorkPlace&);

/// Runs a worker in mode plan and returns its text.
Result<std::string> run_plan(const JobInputs&, const std::string& recipe, const StopSignal&, const WorkPlace&);

}  // namespace kiln
