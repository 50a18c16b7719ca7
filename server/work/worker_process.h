#pragma once
// One worker process: started, listened to, ended.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace kiln {

struct WorkerStart {
  std::vector<std::string> command;  // empty: this program with kWorkerWord; the folder is added as last argument
  std::filesystem::path folder;      // absolute; becomes its current directory; takes its stderr as worker.log
  std::uint64_t memory_bytes = 0;    // resident memory it may use; address space is limited generously above it
  std::uint64_t mapped_bytes = 0;    // of the files that it maps, which take address space too
  double cpu_s = 0;                  // processor time it may take; 0: without limit
  int input = -1;                    // becomes its descriptor 0, where the supervisor answers; -1: nothing to read
};

/// Owns the process: the destructor kills and reaps what still runs. The process leads a group of its own.
class WorkerProcess {
 public:
  /// Fails with "spawn_failed": trouble of this machine, not of the job.
  static Result<WorkerProcess> start(const WorkerStart&);
  WorkerProcess(WorkerProcess&&) noexcept;
  WorkerProcess& operator=(WorkerProcess&&) = delete;
  ~WorkerProcess();

  /// What poll() can wait for: bytes on the pipe (-1 once the worker closed it), and the end of the process.
  int pipe() const { return pipe_; }
  int end() const { return end_; }

  /// Whole lines that arrived. A line longer than 64 KiB comes cut, so that it parses as nothing.
  std::vector<std::string> read_lines();
  /// The wait status once it has ended and was reaped.
  std::optional<int> try_wait();
  void signal(int number) const;  // to the whole group
  /// Memory of its own: pages of files that it maps are the system's.
  std::uint64_t resident_bytes() const;

 private:
  WorkerProcess(pid_t pid, int pipe, int end) : pid_(pid), pipe_(pipe), end_(end) {}
  pid_t pid_;
  int pipe_, end_;
  std::optional<int> status_;
  std::string partial_;
};

}  // namespace kiln
