#include "core/bake/bake_log.h"

#include <sys/resource.h>

namespace kiln {

void BakeLog::begin(const std::string& stage, double fraction) {
  end();
  stages_.push_back({stage, 0, 0});
  stage_start_ = Clock::now();
  running_ = true;
  done_before_ = done_after_;
  done_after_ = low_ + (high_ - low_) * fraction;
  advance(0, 1);
}

void BakeLog::advance(std::uint64_t done, std::uint64_t total) {
  if (!progress_ || stages_.empty()) return;
  const double part = total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total);
  progress_({stages_.back().name, done, total, done_before_ + (done_after_ - done_before_) * part, error_});
}

void BakeLog::count_rays(std::uint64_t rays) {
  if (!stages_.empty()) stages_.back().rays += rays;
}

void BakeLog::end() {
  if (!running_) return;
  running_ = false;
  stages_.back().seconds = std::chrono::duration<double>(Clock::now() - stage_start_).count();
  advance(1, 1);
}

std::uint64_t BakeLog::rays() const {
  std::uint64_t sum = 0;
  for (const StageRecord& stage : stages_) sum += stage.rays;
  return sum;
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace kiln
