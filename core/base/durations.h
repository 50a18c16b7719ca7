#pragma once
// How long things took: counts by length, for a histogram. Any thread may add.

#include <array>
#include <atomic>
#include <cstdint>

namespace kiln {

/// Upper bounds in seconds; what took longer than the last one is counted behind it.
inline constexpr std::array<double, 16> kDurationBounds{0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1,  0.3,
                                                        1,      3,      10,    30,    100,  300,  1000, 3000};

struct DurationCounts {
  std::array<std::uint64_t, kDurationBounds.size() + 1> counts{};  // each length in one place
  double sum_s = 0;
};

class Durations {
 public:
  void add(double seconds);
  DurationCounts snapshot() const;

 private:
  std::array<std::atomic<std::uint64_t>, kDurationBounds.size() + 1> counts_{};
  std::atomic<std::uint64_t> sum_us_{0};
};

}  // namespace kiln
