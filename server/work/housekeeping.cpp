#include "server/work/housekeeping.h"

#include <algorithm>

#include "server/blobs/partial_upload.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Millis kReapEvery{5000};

/// Blobs whose row never came to be. Their age is the blob's own.
Result<int> collect_orphans(const WorkPlace& place, Millis grace) {
  std::vector<std::string> old;
  const double grace_s = std::chrono::duration<double>(grace).count();
  const auto listed = place.blobs.for_each([&](const BlobEntry& blob) {
    if (blob.age_s > grace_s) old.push_back(blob.sha256);
  });
  if (!listed) return tl::make_unexpected(listed.error());
  int removed = 0;
  for (const std::string& sha256 : old) {
    KILN_TRY(alone, place.store.close_blob_gate());
    KILN_TRY(known, place.store.knows_blob(sha256));
    if (!known && place.blobs.remove(sha256)) ++removed;
  }
  return removed;
}

}  // namespace

Result<int> collect_unused_blobs(const WorkPlace& place, Millis grace) {
  int removed = 0;
  {
    // Reference and removal meet here: an upload of the same bytes waits, and then writes them anew.
    KILN_TRY(alone, place.store.close_blob_gate());
    KILN_TRY(unused, place.store.forget_unused_blobs(grace));
    for (const std::string& sha256 : unused) {
      if (place.blobs.remove(sha256)) ++removed;
    }
  }
  KILN_TRY(orphans, collect_orphans(place, grace));
  return removed + orphans;
}

void Housekeeping::start() {
  thread_ = std::thread([this] { work(); });
}

void Housekeeping::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void Housekeeping::work() {
  const Millis collect_every = std::clamp(rules_.grace / 20, Millis(1000), Millis(600'000));
  auto collected = Clock::now();
  std::unique_lock lock(mutex_);
  const Millis reap_every = std::min(kReapEvery, place_.options.lease / 4);
  while (!changed_.wait_for(lock, std::min(reap_every, collect_every), [&] { return stopping_; })) {
    lock.unlock();
    const bool collect = Clock::now() - collected >= collect_every;
    if (collect) collected = Clock::now();
    try {
      tidy(collect);
    } catch (const std::exception&) {  // a folder that cannot be read now: the next round tries again
    }
    lock.lock();
  }
}

void Housekeeping::tidy(bool collect) {
  if (const auto reaped = place_.store.reap(); reaped && *reaped > 0) {
    place_.counters.reaped += static_cast<std::uint64_t>(*reaped);
    place_.bus.announce();
  }
  if (!collect) return;
  const auto forgotten = place_.store.forget_old_jobs(rules_.retention);
  if (forgotten) place_.counters.forgotten += static_cast<std::uint64_t>(*forgotten);
  static_cast<void>(collect_unused_blobs(place_, rules_.grace));  // a store that cannot write now: the next round
  place_.blobs.expire_partials(static_cast<double>(PartialUploads::kKept.count()));
  place_.blobs.remove_dead_writers();
}

}  // namespace kiln
