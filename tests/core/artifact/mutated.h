#pragma once
// Damage at random, and what each answer to it may cost.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "core/base/random.h"
#include "tests/core/artifact/peak_memory.h"

namespace kiln::test {

/// How many damaged inputs a test reads: KILN_MUTATIONS in the environment, or 2000.
inline std::uint64_t mutation_count() {
  const char* asked = std::getenv("KILN_MUTATIONS");
  return asked == nullptr ? 2000 : std::strtoull(asked, nullptr, 10);
}

/// Flips, copies, cuts or inserts a few bytes behind the first `keep`; every fourth time a digit changes instead.
inline std::vector<std::uint8_t> mutated(std::vector<std::uint8_t> file, Random& random, std::size_t keep) {
  const auto any = [&](std::size_t n) { return static_cast<std::size_t>(random.next() % n); };
  const std::size_t changes = 1 + any(4);
  for (std::size_t i = 0; i < changes && file.size() > 2 * keep; ++i) {
    const std::size_t at = keep + any(file.size() - keep);
    switch (any(8)) {
      case 0:
        file[at] = static_cast<std::uint8_t>(random.next());
        break;
      case 1:
        file[at] ^= static_cast<std::uint8_t>(1U << any(8));
        break;
      case 2:
        file[at] = 0xFF;
        break;
      case 3:
        file[at] = file[keep + any(file.size() - keep)];
        break;
      case 4:
        file.resize(at);
        break;
      case 5:
        file.insert(file.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::uint8_t>(random.next()));
        break;
      default:
        for (std::size_t k = at; k < file.size(); ++k) {
          if (file[k] < '0' || file[k] > '9') continue;
          file[k] = static_cast<std::uint8_t>('0' + any(10));
          break;
        }
    }
  }
  return file;
}

/// The processor time of each answer (wall time is other people's too), and the memory of all.
class Costs {
 public:
  template <class F>
  auto of(F&& answer) {
    const double begin = processor_s();
    auto result = answer();
    worst_s_ = std::max(worst_s_, processor_s() - begin);
    return result;
  }
  /// Fails when an answer took 5 s or more, or all together came to hold 200 MB.
  void expect_small(const char* kind, std::uint64_t inputs, std::uint64_t accepted) const {
    const std::uint64_t grown = peak_memory_bytes() - std::min(peak_memory_bytes(), before_);
    EXPECT_LT(worst_s_, 5);
    EXPECT_LT(grown, 200u << 20);
    std::printf("{\"mutated\":\"%s\",\"inputs\":%llu,\"accepted\":%llu,\"worst_s\":%.3f,\"memory_mb\":%.1f}\n", kind,
                static_cast<unsigned long long>(inputs), static_cast<unsigned long long>(accepted), worst_s_,
                static_cast<double>(grown) / (1 << 20));
  }

 private:
  static std::uint64_t start() {
    reset_peak_memory();
    return peak_memory_bytes();
  }
  static double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
  std::uint64_t before_ = start();
  double worst_s_ = 0;
};

}  // namespace kiln::test
