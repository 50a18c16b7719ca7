#include "server/work/neighbours.h"

#include <utility>

namespace kiln {
namespace {

constexpr Millis kLookEvery{2000};  // notices may get lost: this is the truth
constexpr int kMostShown = 200;     // running jobs whose progress is passed on

bool same(const JobProgress& a, const JobProgress& b) {
  return a.stage == b.stage && a.done == b.done && a.fraction == b.fraction;
}

}  // namespace

void Neighbours::start() {
  if (!place_.store.shared()) return;
  place_.store.on_change([this] {
    const std::lock_guard lock(mutex_);
    nudged_ = true;
    changed_.notify_all();
  });
  thread_ = std::thread([this] { work(); });
}

void Neighbours::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (!thread_.joinable()) return;
  place_.store.on_change({});
  thread_.join();
}

void Neighbours::work() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    changed_.wait_for(lock, kLookEvery, [&] { return stopping_ || nudged_; });
    if (stopping_) return;
    nudged_ = false;
    lock.unlock();
    look();
    lock.lock();
  }
}

void Neighbours::look() {
  supervisor_.wake();
  supervisor_.look_for_cancels();
  show_progress();
  place_.bus.announce();
}

void Neighbours::show_progress() {
  JobQuery running;
  running.state = JobState::running;
  running.limit = kMostShown;
  const auto page = place_.store.list(running);
  if (!page) return;
  std::map<std::string, JobProgress> now;
  for (const Job& job : page->jobs) {
    if (!job.progress || supervisor_.runs(job.id)) continue;
    const auto before = shown_.find(job.id);
    if (before == shown_.end() || !same(before->second, *job.progress)) {
      place_.bus.announce_progress(job.id, *job.progress);
    }
    now[job.id] = *job.progress;
  }
  for (const auto& [id, progress] : shown_) {
    if (!now.contains(id) && !supervisor_.runs(id)) place_.bus.end_progress(id);
  }
  shown_ = std::move(now);
}

}  // namespace kiln
