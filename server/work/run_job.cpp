#include "server/work/run_job.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <optional>
#include <random>
#include <sstream>
#include <thread>

#include "core/bake/recipe.h"
#include "server/jobs/ids.h"
#include "server/work/checkpoint_file.h"
#include "server/work/part_desk.h"
#include "server/work/work_folder.h"
#include "server/work/worker_protocol.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = WorkerOutcome::Kind;

constexpr Millis kStoreProgressEvery{5000};
constexpr auto kShowProgressEvery = std::chrono::milliseconds(50);
constexpr double kPlanWallS = 60;

int status_of(Kind kind) {
  const bool own_fault = kind == Kind::refused || kind == Kind::out_of_memory || kind == Kind::timed_out;
  return own_fault ? 422 : 500;
}

/// A stored recipe was canonical once; this program may be another one than that which stored it.
Result<Limits> limits_of(const std::string& recipe) {
  const auto parsed = parse_recipe(recipe);
  if (!parsed) return fault("internal", "this server does not understand the job's recipe any more");
  return parsed->limits;
}

WorkerOrder order_of(const JobInputs& inputs, const std::string& recipe, const Limits& limits,
                     const WorkOptions& options) {
  WorkerOrder order;
  order.inputs = inputs;
  order.recipe = recipe;
  order.threads = limits.threads > 0 ? limits.threads : options.threads;
  order.require_sandbox = options.require_sandbox;
  order.parent = static_cast<int>(::getpid());
  return order;
}

/// Of the files that its worker maps: the scene, and the journal of a part.
std::uint64_t mapped_bytes(const WorkFolder& folder) {
  std::uint64_t sum = 0;
  for (const std::string& file : {input_path(0), std::string("inputs/journal")}) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(folder.path() / file, error);
    if (!error) sum += bytes;
  }
  return sum;
}

/// Progress and heartbeats of one run, from the first byte of input that is fetched to the last of a result that is
/// stored: a thread of its own, since either may take longer than a lease.
class Pulse {
 public:
  Pulse(const Claim& claim, StopSignal& stop, const WorkPlace& place) : claim_(claim), stop_(stop), place_(place) {
    thread_ = std::thread([this] { work(); });
  }
  Pulse(const Pulse&) = delete;
  Pulse& operator=(const Pulse&) = delete;
  ~Pulse() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }

  void progress(const ProgressEvent& event) {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    const bool new_stage = event.stage != newest_.stage;
    newest_ = {event.stage, event.done, event.total, std::max(newest_.fraction, event.fraction), {}, event.error};
    const double elapsed = std::chrono::duration<double>(now - started_).count();
    if (newest_.fraction > 0.01) newest_.eta_s = elapsed * (1 - newest_.fraction) / newest_.fraction;
    if (!new_stage && now - shown_ < kShowProgressEvery) return;
    shown_ = now;
    if (claim_.job.part) return;  // in no stream
    place_.bus.announce_progress(claim_.ref.job_id, newest_);
  }

 private:
  void work() {
    const Millis lease = place_.options.lease;
    auto answered = Clock::now();
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, std::min(kStoreProgressEvery, lease / 4), [&] { return over_; })) {
      const JobProgress newest = newest_;
      lock.unlock();
      const auto beat = place_.store.heartbeat(claim_.ref, lease, newest);
      if (beat) answered = Clock::now();
      // Without an answer the job is given up before the store gives it to another.
      const bool too_late = !beat && Clock::now() - answered > lease * 3 / 4;
      if (too_late || (beat && *beat == Beat::lost)) stop_.ask(StopReason::lost);
      if (beat && *beat == Beat::cancel_requested) stop_.ask(StopReason::cancel);
      lock.lock();
    }
  }

  const Claim& claim_;
  StopSignal& stop_;
  const WorkPlace& place_;
  const Clock::time_point started_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  Clock::time_point shown_{};
  JobProgress newest_;
  std::thread thread_;
};

/// Tries again while the store cannot write, as long as the claim may hold; the queue waits meanwhile.
template <class Write>
Result<Wrote> persist(const StopSignal& stop, Millis lease, Write&& write) {
  const auto deadline = Clock::now() + lease;
  for (Millis pause{100};; pause = std::min(pause * 2, Millis(2000))) {
    Result<Wrote> wrote = write();
    if (wrote || Clock::now() > deadline || stop.asked() == StopReason::drain) return wrote;
    std::this_thread::sleep_for(pause);
  }
}

/// What a worker can take in this time on all processors: it ends the worker when nobody looks at the clock.
double processor_s(double wall_s) { return wall_s * std::max(1U, std::thread::hardware_concurrency()); }

class JobRun {
 public:
  JobRun(const Claim& claim, StopSignal& stop, const WorkPlace& place)
      : claim_(claim), stop_(stop), place_(place), checkpoint_(place.options.checkpoints, claim.ref.job_id) {}

  void run() {
    const bool afresh = claim_.job.force || claim_.job.part;
    const auto known = afresh ? std::vector<Artifact>{} : known_result();
    if (!known.empty()) {
      succeed(known, true);
    } else {
      conclude();
    }
    place_.bus.end_progress(claim_.ref.job_id);
    place_.bus.announce();
  }

 private:
  /// A twin may have finished while this job waited.
  std::vector<Artifact> known_result() const {
    return place_.store.find_result(claim_.job.content_key).value_or(std::vector<Artifact>{});
  }

  void conclude() {
    const auto limits = limits_of(claim_.job.recipe);
    if (!limits) return fail({limits.error(), 500});
    Pulse pulse(claim_, stop_, place_);
    const auto path = place_.options.folder / (claim_.ref.job_id + "." + claim_.ref.token);
    WorkerOrder order = order_of(claim_.job.inputs, claim_.job.recipe, *limits, place_.options);
    if (claim_.job.part) return conclude_part(std::move(order), path, *limits, pulse);
    order.checkpoint = checkpoint_.load();
    std::optional<PartDesk> desk;
    if (place_.options.sharing.least_s > 0) desk.emplace(claim_, place_, path, order.checkpoint);
    if (desk && desk->worker_end() < 0) desk.reset();
    if (desk) {
      order.sharing = place_.options.sharing;
      order.known = desk->known();
    }
    const auto folder = WorkFolder::make(path, place_.blobs, order);
    if (!folder) return after_trouble(folder.error());
    const WorkerOutcome outcome = bake(*folder, *limits, pulse, desk ? &*desk : nullptr);
    desk.reset();
    end_as(outcome, *folder);
  }

  void conclude_part(WorkerOrder order, const std::filesystem::path& path, const Limits& limits, Pulse& pulse) {
    const auto part = parse_part(claim_.job.part->order);
    if (!part) return fail({part.error(), 500});
    order.mode = WorkerMode::part;
    order.range = part->range;
    order.checkpoint = part->checkpoint;
    order.journal = claim_.job.part->journal;
    const auto folder = WorkFolder::make(path, place_.blobs, order);
    if (!folder) return after_trouble(folder.error());
    end_as(bake(*folder, limits, pulse, nullptr), *folder);
  }

  WorkerOutcome bake(const WorkFolder& folder, const Limits& limits, Pulse& pulse, PartDesk* desk) {
    const std::uint64_t memory = limits.memory_mb << 20;
    WorkerNews news{[&](const ProgressEvent& event) { pulse.progress(event); }, {}, {}};
    if (!claim_.job.part) news.checkpoint = [&](const std::string& text) { checkpoint_.save(text); };
    if (desk != nullptr) {
      news.parts = [desk](const WorkerLine& line) { return desk->hear(line); };
      news.checkpoint = [this, desk](const std::string& text) {
        checkpoint_.save(text);
        desk->pass_ended(text);
      };
    }
    return run_worker({place_.options.worker_command, folder.path(), memory, mapped_bytes(folder),
                       processor_s(limits.wall_s), desk != nullptr ? desk->worker_end() : -1},
                      {memory, limits.wall_s}, stop_, news);
  }

  void end_as(const WorkerOutcome& outcome, const WorkFolder& folder) {
    switch (outcome.kind) {
      case Kind::done:
        return store_results(outcome, folder);
      case Kind::stopped:
        return after_stop();
      case Kind::trouble:
        return after_trouble(outcome.fault);
      case Kind::crashed:
        return after_crash(outcome.fault);
      case Kind::out_of_memory:
        ++place_.counters.deaths_memory;
        break;
      case Kind::timed_out:
        ++place_.counters.deaths_timeout;
        break;
      case Kind::refused:
      case Kind::internal:
        break;
    }
    fail({outcome.fault, status_of(outcome.kind)});
  }

  void store_results(const WorkerOutcome& outcome, const WorkFolder& folder) {
    const auto gate = place_.store.enter_blob_gate();
    if (!gate) return after_trouble(gate.error());
    std::vector<std::filesystem::path> files;
    for (const WorkerArtifact& named : outcome.artifacts) files.push_back(folder.result(named.name));
    const auto stored = place_.blobs.adopt(files);
    if (!stored && stored.error().code == "not_found") {
      return fail({{"internal", "the worker named a result that it did not make", ""}, 500});
    }
    if (!stored) return after_trouble(stored.error());
    std::vector<Artifact> artifacts;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const WorkerArtifact& named = outcome.artifacts[i];
      artifacts.push_back({named.name, named.media_type, (*stored)[i].sha256, (*stored)[i].bytes});
    }
    if (artifacts.empty()) return fail({{"internal", "the worker made no result", ""}, 500});
    succeed(artifacts, false);
  }

  void succeed(const std::vector<Artifact>& artifacts, bool cached) {
    if (!wrote(
            persist(stop_, place_.options.lease, [&] { return place_.store.commit(claim_.ref, artifacts, cached); })))
      return;
    if (claim_.job.part) {
      ++place_.counters.parts;
      return;
    }
    checkpoint_.remove();
    ++place_.counters.succeeded;
    if (cached) ++place_.counters.cached;
  }

  void fail(const JobError& error) {
    if (!wrote(persist(stop_, place_.options.lease, [&] { return place_.store.fail(claim_.ref, error); }))) return;
    if (claim_.job.part) return;  // whose part it is computes it itself
    checkpoint_.remove();
    ++place_.counters.failed;
  }

  void after_stop() {
    if (stop_.asked() == StopReason::lost) {
      if (!claim_.job.part) ++place_.counters.lost_leases;  // a part ends so with its job
      return;
    }
    if (stop_.asked() == StopReason::drain) {
      static_cast<void>(wrote(place_.store.release(claim_.ref)));  // else the next start finds and requeues it
    } else {
      finish_cancel();
    }
  }

  void after_crash(const Fault& fault) {
    ++place_.counters.deaths_signal;
    if (claim_.job.crashes + 1 >= kMaxCrashes) return fail({fault, 500});
    retry({fault.message, true, Millis(0)});
  }

  void after_trouble(const Fault& fault) {
    if (claim_.job.retries >= kMaxRetries || fault.code == "asset_lost") {
      return fail({fault, fault.code == "disk_full" ? 507 : 500});
    }
    std::random_device device;
    const double jitter = std::uniform_real_distribution(0.0, 1.0)(device);
    retry({fault.message, false, retry_delay(place_.options.first_retry, claim_.job.retries, jitter)});
  }

  void retry(const Retry& how) {
    if (wrote(persist(stop_, place_.options.lease, [&] { return place_.store.retry(claim_.ref, how); })))
      ++place_.counters.retried;
  }

  /// False when nothing was written: canceled meanwhile, fenced off, or the store is out of order.
  bool wrote(const Result<Wrote>& result) {
    if (result && *result == Wrote::done) return true;
    if (result) finish_cancel();
    return false;
  }

  void finish_cancel() {
    const auto ended = persist(stop_, place_.options.lease, [&] { return place_.store.finish_cancel(claim_.ref); });
    if (!ended || claim_.job.part) return;
    checkpoint_.remove();
    ++(*ended == Wrote::done ? place_.counters.canceled : place_.counters.stale_commits);
  }

  const Claim& claim_;
  StopSignal& stop_;
  const WorkPlace& place_;
  const CheckpointFile checkpoint_;
};

Result<std::string> read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) return fault("internal", "the worker made no plan");
  return text.str();
}

}  // namespace

Millis retry_delay(Millis first, int retries, double jitter) {
  constexpr double kMostMs = 3'600'000;
  const double delay = static_cast<double>(first.count()) * std::pow(4.0, retries) * (1 + 0.25 * jitter);
  return Millis(static_cast<std::int64_t>(std::min(delay, kMostMs)));
}

void run_job(const Claim& claim, StopSignal& stop, const WorkPlace& place) { JobRun(claim, stop, place).run(); }

Result<std::string> run_plan(const JobInputs& inputs, const std::string& recipe, const StopSignal& stop,
                             const WorkPlace& place) {
  KILN_TRY(limits, limits_of(recipe));
  WorkerOrder order = order_of(inputs, recipe, limits, place.options);
  order.mode = WorkerMode::plan;
  KILN_TRY(folder, WorkFolder::make(place.options.folder / ("plan." + random_token()), place.blobs, order));
  const std::uint64_t memory = limits.memory_mb << 20;
  const double wall_s = std::min(limits.wall_s, kPlanWallS);
  const WorkerOutcome outcome =
      run_worker({place.options.worker_command, folder.path(), memory, mapped_bytes(folder), processor_s(wall_s)},
                 {memory, wall_s}, stop, {});
  if (outcome.kind == Kind::done) return read_text(folder.result("plan.json"));
  if (outcome.kind == Kind::stopped) return fault("draining", "the server stops");
  return tl::make_unexpected(outcome.fault);
}

}  // namespace kiln
