#pragma once
// What a bake tells while it runs and what it remembers for its report.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/progress.h"

namespace kiln {

struct StageRecord {
  std::string name;
  double seconds = 0;
  std::uint64_t rays = 0;
};

/// Runs the stages of one bake in order: times them and reports progress as a fraction of the whole.
class BakeLog {
 public:
  explicit BakeLog(Progress progress) : progress_(std::move(progress)), start_(Clock::now()), stage_start_(start_) {}

  /// The stages that follow share this part of the whole: their fractions count from its begin to its end.
  void share(double begin, double end) { low_ = begin, high_ = end; }
  /// What the bake knows of its error; told with the progress from now on.
  void know_error(double relrmse) { error_ = relrmse; }
  /// Ends the stage before, if any, and starts one that brings the whole job to `fraction` when it ends.
  void begin(const std::string& stage, double fraction);
  /// Progress within the stage.
  void advance(std::uint64_t done, std::uint64_t total);
  void count_rays(std::uint64_t rays);
  void end();

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  const std::vector<StageRecord>& stages() const { return stages_; }
  std::uint64_t rays() const;

 private:
  using Clock = std::chrono::steady_clock;
  Progress progress_;
  Clock::time_point start_, stage_start_;
  std::vector<StageRecord> stages_;
  bool running_ = false;
  double low_ = 0, high_ = 1;  // the share of the stages under way
  double done_before_ = 0, done_after_ = 0;
  std::optional<double> error_;
};

/// The largest resident size this process has had, in bytes.
std::uint64_t peak_memory_bytes();

}  // namespace kiln
