#pragma once
// Wakes everyone who waits for news of jobs. Durable news lies in the store; the newest progress of each job lies here.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "server/jobs/job.h"

namespace kiln {

/// Readers remember `ticks()` before they look, look, and wait for it to move: no news is missed.
class EventBus {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  /// Something was written to the store.
  void announce();
  void announce_progress(const std::string& job_id, const JobProgress&);
  /// The job left its worker: its progress is over.
  void end_progress(const std::string& job_id);
  /// Wakes all for good.
  void close();

  bool closed() const;
  std::uint64_t ticks() const;
  /// Returns when ticks() differs from `seen`, at the deadline, or when closed; false at the deadline or closed.
  bool wait(std::uint64_t seen, Deadline) const;

  std::optional<JobProgress> progress_of(const std::string& job_id) const;
  struct Progress {
    std::uint64_t number = 0;
    std::string job_id;
    JobProgress progress;
  };
  /// The oldest progress with a number above `after`, of one job, or of any when `job_id` is empty.
  std::optional<Progress> progress_after(std::uint64_t after, const std::string& job_id) const;

 private:
  void tick();  // under mutex_
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::uint64_t ticks_ = 0;
  std::map<std::string, Progress> newest_;
  bool closed_ = false;
};

}  // namespace kiln
