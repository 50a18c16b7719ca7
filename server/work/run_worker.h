#pragma once
// From the start of a worker to the reason of its end.

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "server/work/worker_process.h"
#include "server/work/worker_protocol.h"

namespace kiln {

enum class StopReason { none, cancel, drain, lost };  // lost: the claim is somebody else's now

/// How other threads reach the one that watches a worker. The first reason counts.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  void ask(StopReason);
  StopReason asked() const { return asked_.load(); }
  int descriptor() const { return descriptor_; }  // readable once asked

 private:
  std::atomic<StopReason> asked_{StopReason::none};
  int descriptor_;
};

struct WorkerLimits {
  std::uint64_t memory_bytes = 0;  // resident; 0: none
  double wall_s = 0;               // 0: none
  double grace_s = 0.4;            // between TERM and KILL: a cancel takes effect within a second
};

struct WorkerOutcome {
  enum class Kind {
    done,     // it said so and exit code and lines agree
    refused,  // the input's own fault
    stopped,  // as asked: see StopSignal
    crashed,  // by a signal that we did not send
    out_of_memory,
    timed_out,
    internal,  // it broke the protocol or failed by its own fault
    trouble,   // of this machine: disk full, no process to be had
  } kind = Kind::internal;
  Fault fault;  // all but done and stopped
  std::vector<WorkerArtifact> artifacts;
};

struct WorkerNews {
  std::function<void(const ProgressEvent&)> progress;
  std::function<void(const std::string&)> checkpoint;
  /// Of share, next and made; false ends the worker. Empty: it has no business to say so.
  std::function<bool(const WorkerLine&)> parts;
};

/// Blocks until the process is gone. Never throws, whatever the worker does.
WorkerOutcome run_worker(const WorkerStart&, const WorkerLimits&, const StopSignal&, const WorkerNews&);

}  // namespace kiln
