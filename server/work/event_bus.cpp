#include "server/work/event_bus.h"

namespace kiln {

void EventBus::tick() {
  ++ticks_;
  changed_.notify_all();
}

void EventBus::announce() {
  const std::lock_guard lock(mutex_);
  tick();
}

void EventBus::announce_progress(const std::string& job_id, const JobProgress& progress) {
  const std::lock_guard lock(mutex_);
  tick();
  newest_[job_id] = {ticks_, job_id, progress};
}

void EventBus::end_progress(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  newest_.erase(job_id);
}

void EventBus::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

bool EventBus::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::uint64_t EventBus::ticks() const {
  const std::lock_guard lock(mutex_);
  return ticks_;
}

bool EventBus::wait(std::uint64_t seen, Deadline deadline) const {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [&] { return closed_ || ticks_ != seen; });
  return !closed_ && ticks_ != seen;
}

std::optional<JobProgress> EventBus::progress_of(const std::string& job_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = newest_.find(job_id);
  if (found == newest_.end()) return std::nullopt;
  return found->second.progress;
}

std::optional<EventBus::Progress> EventBus::progress_after(std::uint64_t after, const std::string& job_id) const {
  const std::lock_guard lock(mutex_);
  std::optional<Progress> oldest;
  for (const auto& [id, entry] : newest_) {
    if (entry.number <= after || (!job_id.empty() && id != job_id)) continue;
    if (!oldest || entry.number < oldest->number) oldest = entry;
  }
  return oldest;
}

}  // namespace kiln
