#pragma once
// Loops of property tests: many seeds in CI, one to look at, hours to soak.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace kiln::test {

inline const char* setting(const char* name) { return std::getenv(name); }  // NOLINT(concurrency-mt-unsafe)

/// Calls body(seed) for `cases` seeds and stops at the first that fails; its trace names the seed.
///   KILN_SEED=n      only seed n
///   KILN_SOAK=hours  as many seeds as fit into so many hours for each property
template <class Body>
void for_seeds(std::uint64_t cases, const Body& body) {
  using Clock = std::chrono::steady_clock;
  std::uint64_t first = 0, end = cases;
  if (const char* one = setting("KILN_SEED")) first = std::strtoull(one, nullptr, 10), end = first + 1;
  const char* soak = setting("KILN_SOAK");
  const auto until = Clock::now() + std::chrono::duration<double, std::ratio<3600>>(soak ? std::atof(soak) : 0);
  for (std::uint64_t seed = first; seed < end || (soak != nullptr && Clock::now() < until); ++seed) {
    SCOPED_TRACE("repeat with KILN_SEED=" + std::to_string(seed));
    body(seed);
    if (::testing::Test::HasFailure()) return;
  }
}

}  // namespace kiln::test
