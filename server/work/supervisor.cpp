#include "server/work/supervisor.h"

#include <algorithm>

namespace kiln {
namespace {

constexpr Millis kLongestRest{2000};  // wake() is the fast way; this is the truth

}  // namespace

Supervisor::Supervisor(WorkPlace place, const Means& means, std::function<bool()> may_claim)
    : place_(place), means_(means), may_claim_(std::move(may_claim)) {}

Supervisor::~Supervisor() { stop(); }

void Supervisor::start() {
  for (int i = 0; i < means_.workers; ++i) threads_.emplace_back([this] { work(); });
}

void Supervisor::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    for (const auto& [id, signal] : running_) signal->ask(StopReason::drain);
    changed_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void Supervisor::wake() {
  const std::lock_guard lock(mutex_);
  ++wakes_;
  changed_.notify_all();
}

void Supervisor::cancel(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  const auto found = running_.find(job_id);
  if (found != running_.end()) found->second->ask(StopReason::cancel);
}

void Supervisor::look_for_cancels() {
  std::vector<std::string> ids;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, signal] : running_) ids.push_back(id);
  }
  for (const std::string& id : ids) {
    const auto job = place_.store.get(id);
    if (job && job->cancel_requested) cancel(id);
  }
}

bool Supervisor::runs(const std::string& job_id) const {
  const std::lock_guard lock(mutex_);
  return running_.contains(job_id);
}

void Supervisor::work() {
  while (true) {
    std::uint64_t seen = 0;
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
      seen = wakes_;
    }
    const auto next = claim();
    if (next && *next) {
      run(**next);
    } else {
      rest(seen);
    }
  }
}

Result<std::optional<Claim>> Supervisor::claim() {
  if (!may_claim_()) return std::nullopt;
  const std::lock_guard one_at_a_time(claiming_);
  Taker taker{.maker = maker_};
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return std::nullopt;  // others may have waited for a store that does not answer
    taker.idle = taken_ == 0;
    taker.free_mb = means_.memory_mb - std::min(means_.memory_mb, taken_mb_);
  }
  auto next = place_.store.claim(place_.options.lease, taker);
  if (!next || !*next) return next;
  const std::lock_guard lock(mutex_);
  ++taken_;
  taken_mb_ += (*next)->job.memory_mb;
  return next;
}

void Supervisor::run(const Claim& claim) {
  const auto signal = std::make_shared<StopSignal>();
  {
    const std::lock_guard lock(mutex_);
    running_[claim.ref.job_id] = signal;
    if (stopping_) signal->ask(StopReason::drain);
  }
  // Asked for between the claim and the entry above: nobody could tell this worker.
  const auto job = place_.store.get(claim.ref.job_id);
  if (job && job->cancel_requested) signal->ask(StopReason::cancel);
  if (!claim.job.part) {
    ++place_.counters.claimed;
    place_.counters.claim_latency.add(static_cast<double>(claim.job.started_ms - claim.job.created_ms) / 1000);
  }
  place_.bus.announce();
  try {
    run_job(claim, *signal, place_);
  } catch (const std::exception&) {  // a fault of ours ends the job, never the server
    static_cast<void>(place_.store.fail(claim.ref, {{"internal", "the server failed to run the job", ""}, 500}));
    if (!claim.job.part) ++place_.counters.failed;
    place_.bus.announce();
  }
  const std::lock_guard lock(mutex_);
  running_.erase(claim.ref.job_id);
  --taken_;
  taken_mb_ -= claim.job.memory_mb;
  changed_.notify_all();
}

void Supervisor::rest(std::uint64_t seen) {
  const auto due = place_.store.next_due().value_or(std::nullopt).value_or(kLongestRest);
  // A job that is due already but was not taken waits for the disk or the store: no spinning.
  const Millis pause = std::clamp(due, Millis(200), kLongestRest);
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, pause, [&] { return stopping_ || wakes_ != seen; });
}

}  // namespace kiln
