#pragma once
// How much memory this process may count on: that of the machine, or less where a control group says so.
//
// Version 2 of control groups (memory.max) and version 1 (memory.limit_in_bytes); a group is bounded by those around
// it too. Inside a container its own group is the root of what is seen.

#include <cstdint>
#include <filesystem>

namespace kiln {

/// In MiB. Files are looked for under `root`; what cannot be read sets no bound.
std::uint64_t machine_memory_mb(const std::filesystem::path& root = "/");

}  // namespace kiln
