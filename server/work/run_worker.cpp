#include "server/work/run_worker.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "core/base/expects.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = WorkerOutcome::Kind;

constexpr int kTickMs = 200;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string megabytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MB"; }

/// Watches one process. The first cause of an end is the one reported; what follows from it is not news.
class Watch {
 public:
  Watch(WorkerProcess& worker, const WorkerLimits& limits, const StopSignal& stop, const WorkerNews& news)
      : worker_(worker), limits_(limits), stop_(stop), news_(news) {}

  WorkerOutcome run() {
    while (true) {
      wait();
      for (const std::string& line : worker_.read_lines()) take(line);
      if (const auto status = worker_.try_wait()) {
        for (const std::string& line : worker_.read_lines()) take(line);
        return finish(*status);
      }
      check_limits();
      press();
    }
  }

 private:
  void wait() const {
    const bool asked = ended_by_us();
    std::array<pollfd, 3> what{pollfd{worker_.pipe(), POLLIN, 0}, pollfd{worker_.end(), POLLIN, 0},
                               pollfd{asked ? -1 : stop_.descriptor(), POLLIN, 0}};
    ::poll(what.data(), what.size(), asked ? 20 : kTickMs);
  }

  void take(const std::string& text) {
    const auto line = parse_line(text);
    if (!line) return end(Kind::internal, {"internal", "the worker sent something unintelligible", ""}, SIGKILL);
    if (const auto* progress = std::get_if<ProgressEvent>(&*line)) {
      if (!ended_by_us() && news_.progress) news_.progress(*progress);
    } else if (const auto* artifact = std::get_if<WorkerArtifact>(&*line)) {
      const bool again = std::ranges::count(outcome_.artifacts, artifact->name, &WorkerArtifact::name) > 0;
      if (again || !is_artifact_name(artifact->name) || outcome_.artifacts.size() >= 64) {
        return end(Kind::internal, {"internal", "the worker named an impossible result", ""}, SIGKILL);
      }
      outcome_.artifacts.push_back(*artifact);
    } else if (const auto* checkpoint = std::get_if<WorkerCheckpoint>(&*line)) {
      if (!ended_by_us() && news_.checkpoint) news_.checkpoint(checkpoint->text);
    } else if (const auto* fault = std::get_if<Fault>(&*line)) {
      told_ = *fault;
    } else if (std::holds_alternative<WorkerDone>(*line)) {
      said_done_ = true;
    } else if (news_.parts) {
      if (!ended_by_us() && !news_.parts(*line))
        end(Kind::internal, {"internal", "the worker did not wait for its answers", ""}, SIGKILL);
    } else {
      end(Kind::internal, {"internal", "the worker offered work to others", ""}, SIGKILL);
    }
  }

  void check_limits() {
    if (ended_by_us()) return;
    if (stop_.asked() != StopReason::none) return end(Kind::stopped, {}, SIGTERM);
    if (limits_.wall_s > 0 && seconds_since(started_) > limits_.wall_s) {
      const std::string limit = std::to_string(limits_.wall_s);
      return end(Kind::timed_out,
                 {"timed_out", "the job took longer than its limit of " + limit.substr(0, limit.find('.') + 2) + " s",
                  "/limits/wall_s"},
                 SIGKILL);
    }
    if (limits_.memory_bytes > 0 && worker_.resident_bytes() > limits_.memory_bytes) {
      return end(Kind::out_of_memory,
                 {"out_of_memory", "the job needed more than its limit of " + megabytes(limits_.memory_bytes),
                  "/limits/memory_mb"},
                 SIGKILL);
    }
  }

  void end(Kind kind, Fault fault, int signal_number) {
    if (ended_by_us()) return;
    outcome_.kind = kind;
    outcome_.fault = std::move(fault);
    ended_at_ = Clock::now();
    worker_.signal(signal_number);
  }

  /// KILL for who did not listen to TERM.
  void press() const {
    if (ended_by_us() && seconds_since(*ended_at_) > limits_.grace_s) worker_.signal(SIGKILL);
  }

  static Fault processor_time_is_over() {
    return {"timed_out", "the job took more processor time than its limit of wall time leaves it", "/limits/wall_s"};
  }
  bool ended_by_us() const { return ended_at_.has_value(); }

  WorkerOutcome finish(int status) {
    if (ended_by_us()) return outcome_;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return conclude(Kind::timed_out, processor_time_is_over());
    if (WIFSIGNALED(status)) {
      return conclude(Kind::crashed,
                      {"worker_crashed", "the worker process died of signal " + std::to_string(WTERMSIG(status)), ""});
    }
    const int code = WEXITSTATUS(status);
    if (told_ && told_->code == "disk_full") return conclude(Kind::trouble, *told_);
    if (told_ && told_->code == "out_of_memory") return conclude(Kind::out_of_memory, *told_);
    if (code == kExitDone && said_done_) return conclude(Kind::done, {});
    if (code == kExitRefused && told_) return conclude(Kind::refused, *told_);
    if (code == kExitInternal && told_) return conclude(Kind::internal, *told_);
    return conclude(Kind::internal,
                    {"internal", "the worker process ended with code " + std::to_string(code) + " and no result", ""});
  }

  WorkerOutcome conclude(Kind kind, Fault fault) {
    outcome_.kind = kind;
    outcome_.fault = std::move(fault);
    return outcome_;
  }

  WorkerProcess& worker_;
  const WorkerLimits& limits_;
  const StopSignal& stop_;
  const WorkerNews& news_;
  const Clock::time_point started_ = Clock::now();
  std::optional<Clock::time_point> ended_at_;
  std::optional<Fault> told_;
  bool said_done_ = false;
  WorkerOutcome outcome_;
};

}  // namespace

StopSignal::StopSignal() : descriptor_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) { EXPECTS(descriptor_ >= 0); }

StopSignal::~StopSignal() { ::close(descriptor_); }

void StopSignal::ask(StopReason reason) {
  StopReason none = StopReason::none;
  if (!asked_.compare_exchange_strong(none, reason)) return;
  const std::uint64_t one = 1;
  EXPECTS(::write(descriptor_, &one, sizeof one) == sizeof one);
}

WorkerOutcome run_worker(const WorkerStart& start, const WorkerLimits& limits, const StopSignal& stop,
                         const WorkerNews& news) {
  auto worker = WorkerProcess::start(start);
  if (!worker) return {Kind::trouble, worker.error(), {}};
  return Watch(*worker, limits, stop, news).run();
}

}  // namespace kiln
