#pragma once
// The most memory that this process has held since the last reset.

#include <cstdint>
#include <fstream>
#include <string>

namespace kiln::test {

inline void reset_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

inline std::uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) return kilobytes * 1024;
  }
  return 0;
}

}  // namespace kiln::test
