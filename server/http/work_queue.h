#pragma once
// A bounded queue between the epoll thread and the workers.

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

namespace kiln {

/// A connection whose head is complete.
struct HeadJob {
  int fd = -1;
  std::string peer;
  std::string bytes;  // the head and what came with it
  std::size_t head_size = 0;
};

class WorkQueue {
 public:
  explicit WorkQueue(std::size_t limit) : limit_(limit) {}

  /// False when full: the job stays with the caller.
  bool push(HeadJob& job) {
    {
      const std::lock_guard lock(mutex_);
      if (jobs_.size() >= limit_ || closed_) return false;
      jobs_.push_back(std::move(job));
    }
    waiting_.notify_one();
    return true;
  }

  /// Blocks; nothing once closed and empty.
  std::optional<HeadJob> pop() {
    std::unique_lock lock(mutex_);
    waiting_.wait(lock, [this] { return closed_ || !jobs_.empty(); });
    if (jobs_.empty()) return std::nullopt;
    HeadJob job = std::move(jobs_.front());
    jobs_.pop_front();
    return job;
  }

  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    waiting_.notify_all();
  }

  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return jobs_.size();
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable waiting_;
  std::deque<HeadJob> jobs_;
  std::size_t limit_;
  bool closed_ = false;
};

}  // namespace kiln
