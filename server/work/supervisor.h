#pragma once
// Takes jobs from the queue and keeps so many workers busy.

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/work/maker.h"
#include "server/work/run_job.h"

namespace kiln {

/// One thread for each worker: it claims, starts a process, watches it, writes the end. Idle threads wait for wake().
class Supervisor {
 public:
  struct Means {
    int workers = 1;
    std::uint64_t memory_mb = 0;  // for all of them
  };
  /// `may_claim` is asked before each claim: false while the disk is nearly full.
  Supervisor(WorkPlace place, const Means&, std::function<bool()> may_claim);
  ~Supervisor();

  void start();
  /// Ends all workers; their jobs go back to the queue. Returns when no process is left.
  void stop();

  /// There may be work.
  void wake();
  /// Ends the worker of this job, if it has one here.
  void cancel(const std::string& job_id);
  /// Ends workers here whose cancel another server wrote down.
  void look_for_cancels();
  bool runs(const std::string& job_id) const;

 private:
  void work();
  Result<std::optional<Claim>> claim();
  void run(const Claim&);
  void rest(std::uint64_t seen);  // until wake() was called after `seen` wakes, a job is due, or two seconds passed

  WorkPlace place_;
  Means means_;
  const std::string maker_ = maker_word();
  std::function<bool()> may_claim_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t wakes_ = 0;
  bool stopping_ = false;
  std::map<std::string, std::shared_ptr<StopSignal>> running_;  // by job id
  std::mutex claiming_;                                         // one at a time, since each takes memory from the next
  std::uint64_t taken_mb_ = 0;                                  // by running jobs
  int taken_ = 0;                                               // how many they are
  std::vector<std::thread> threads_;
};

}  // namespace kiln
