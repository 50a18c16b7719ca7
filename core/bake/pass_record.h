#pragma once
// What one pass of a bake (progressive.h) spent and reached.

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/bake/error_sources.h"

namespace kiln {

struct PassRecord {
  int order = 0, samples = 0, bounce_samples = 0, bounces = 0;
  std::uint64_t triangles = 0, vertices = 0;    // of the result
  std::uint64_t rays = 0, bounce_rays = 0;      // of all, those between surfaces
  double seconds = 0, certificate_seconds = 0;  // all of it, and the part that does not grow with the work
  double elapsed_s = 0;                         // of the bake when the pass ended
  std::uint64_t points = 0, gathered = 0;       // that reflected light lives on; those of them with rays of their own
  double relrmse = 0, low = 0, high = 0;        // transport, with its interval
  std::optional<double> own_relrmse, own_high;  // under the job's own light in full
  ErrorSources sources;

  /// Seconds that grow with rays and triangles.
  double work() const { return std::max(1e-3, seconds - certificate_seconds); }
};

}  // namespace kiln
