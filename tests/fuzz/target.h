#pragma once
// What a fuzz target is: the one function libFuzzer calls, and what it promises of every input.

#include <cstdint>
#include <cstdlib>
#include <string_view>

/// Reads `size` bytes as its target does. A broken promise aborts.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace kiln::fuzz {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

inline void promise(bool kept) {
  if (!kept) std::abort();
}

}  // namespace kiln::fuzz
