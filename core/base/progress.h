#pragma once
// How a long computation tells where it is.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace kiln {

struct ProgressEvent {
  std::string stage;       // "read", "transfer", "bounce 2", ... the order is the bake's
  std::uint64_t done = 0;  // of total, in units of the stage
  std::uint64_t total = 0;
  double fraction = 0;               // of the whole job, in [0, 1], never falling
  std::optional<double> error = {};  // relRMSE of the last pass, where a bake has passes
};

/// Called from any thread, one call at a time. Must return quickly.
using Progress = std::function<void(const ProgressEvent&)>;

}  // namespace kiln
