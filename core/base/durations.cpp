#include "core/base/durations.h"

#include <algorithm>

namespace kiln {

void Durations::add(double seconds) {
  const auto bound = std::ranges::lower_bound(kDurationBounds, seconds);
  counts_[static_cast<std::size_t>(bound - kDurationBounds.begin())] += 1;
  sum_us_ += static_cast<std::uint64_t>(std::max(0.0, seconds) * 1e6);
}

DurationCounts Durations::snapshot() const {
  DurationCounts now;
  for (std::size_t i = 0; i < counts_.size(); ++i) now.counts[i] = counts_[i];
  now.sum_s = static_cast<double>(sum_us_) * 1e-6;
  return now;
}

}  // namespace kiln
