#pragma once
// How a certificate spends its rays: a pilot tells the error and the reference's noise; paths are as many as keep that
// noise below the error, and what they leave of the budget goes into more points.
// Repeat  a function of the scene and the bake's rays, never of time, so that reports repeat

#include <cstddef>
#include <cstdint>

#include "core/bake/error_stats.h"

namespace kiln {

struct Spending {
  static constexpr std::size_t kFewestPoints = 1024, kMostPoints = 8192;
  static constexpr int kPilotSamples = 16;

  std::size_t points = kFewestPoints;
  int samples = 256;
};

/// `pilot` is of kPilotSamples paths at each point. About 5 % of `bake_rays`, or more: about a second where a promise
/// hangs on it (`thorough`), else a tenth of one.
Spending plan_spending(const ErrorStats& pilot, double rays_per_path, std::uint64_t bake_rays, bool thorough);

}  // namespace kiln
