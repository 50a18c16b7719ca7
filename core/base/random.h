#pragma once
// Counter-based random numbers: a value is a function of (seed, item, sample), never of order or thread.

#include <cstdint>

namespace kiln {

/// A strong 64-bit mix (the finaliser of splitmix64, Steele et al. 2014).
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// A stream of independent numbers for one sample of one item.
class Random {
 public:
  constexpr Random(std::uint64_t seed, std::uint64_t item, std::uint64_t sample = 0)
      : state_(mix64(mix64(mix64(seed) ^ item) ^ (sample * 0xd1342543de82ef95ULL))) {}

  constexpr std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    return mix64(state_);
  }
  /// Uniform in [0, 1), 24 bits.
  constexpr float uniform() { return static_cast<float>(next() >> 40) * 0x1p-24F; }
  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform_double() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

}  // namespace kiln
