#pragma once
// What must happen now and then: leases that ended, blobs that nobody needs, uploads that nobody goes on with.

#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/work/run_job.h"

namespace kiln {

/// What goes when it is old or unused.
struct KeepRules {
  Millis grace;         // how long a blob that no job refers to is kept
  Retention retention;  // how long jobs are
};

/// Removes files of blobs that no job refers to and nobody touched for `grace`, and files that no row knows (a crash
/// between the two). Returns how many went.
Result<int> collect_unused_blobs(const WorkPlace&, Millis grace);

/// One thread; reaps every few seconds, forgets old jobs and collects at a twentieth of the grace (1 s .. 10 min).
class Housekeeping {
 public:
  Housekeeping(WorkPlace place, KeepRules rules) : place_(place), rules_(std::move(rules)) {}
  ~Housekeeping() { stop(); }
  void start();
  void stop();

 private:
  void work();
  void tidy(bool collect);
  WorkPlace place_;
  const KeepRules rules_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace kiln
