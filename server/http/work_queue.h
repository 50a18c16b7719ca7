#pragma once
// A bounded queue between the epoll thread and the workers.

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace kiln {

/// A connection whose head is complete.
struct HeadJob {
  int fd = -1;
  std::string peer;
  std::string bytes;  // the head and what came with it
  std::size_t head_size = 0;
};

/// Whoever has waited least takes the next job: what a thread has touched of its stack and of the allocator's caches
/// serves again, and a hundred threads that wait for a crowd take no memory before it comes.
class WorkQueue {
 public:
  explicit WorkQueue(std::size_t limit) : limit_(limit) {}

  /// False when full: the job stays with the caller.
  bool push(HeadJob& job) {
    const std::lock_guard lock(mutex_);
    if (jobs_.size() >= limit_ || closed_) return false;
    jobs_.push_back(std::move(job));
    wake_one();
    return true;
  }

  /// Blocks; nothing once closed and empty.
  std::optional<HeadJob> pop() {
    std::unique_lock lock(mutex_);
    while (jobs_.empty() && !closed_) {
      Sleeper me;
      sleepers_.push_back(&me);
      me.wake.wait(lock, [&me] { return me.woken; });
    }
    if (jobs_.empty()) return std::nullopt;
    HeadJob job = std::move(jobs_.front());
    jobs_.pop_front();
    return job;
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    while (!sleepers_.empty()) wake_one();
  }

  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return jobs_.size();
  }
  std::size_t sleepers() const {
    const std::lock_guard lock(mutex_);
    return sleepers_.size();
  }

 private:
  struct Sleeper {
    std::condition_variable wake;
    bool woken = false;
  };

  /// Under the lock, which the sleeper needs before it can go.
  void wake_one() {
    if (sleepers_.empty()) return;
    Sleeper& last = *sleepers_.back();
    sleepers_.pop_back();
    last.woken = true;
    last.wake.notify_one();
  }

  mutable std::mutex mutex_;
  std::deque<HeadJob> jobs_;
  std::vector<Sleeper*> sleepers_;  // in the order in which they fell asleep
  std::size_t limit_;
  bool closed_ = false;
};

}  // namespace kiln
