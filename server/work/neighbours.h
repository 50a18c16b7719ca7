#pragma once
// What other servers of the fleet do, as far as this one has to know: new jobs, cancels, progress, ends.

#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "server/work/supervisor.h"

namespace kiln {

/// One thread. Looks at the store when it is told that somebody wrote, and every two seconds whatever happens. Does
/// nothing for a store that nobody else writes to.
class Neighbours {
 public:
  Neighbours(WorkPlace place, Supervisor& supervisor) : place_(place), supervisor_(supervisor) {}
  ~Neighbours() { stop(); }
  void start();
  void stop();

 private:
  void work();
  void look();
  void show_progress();

  WorkPlace place_;
  Supervisor& supervisor_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool nudged_ = false, stopping_ = false;
  std::map<std::string, JobProgress> shown_;  // of jobs that run elsewhere
  std::thread thread_;
};

}  // namespace kiln
