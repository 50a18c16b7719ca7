#pragma once
// How a certificate spends its rays. A pilot tells the error and the reference's noise.
//   Of P paths, S at each of P / S points, an estimate of the mean squared error m from points whose squared errors
//   vary by c m^2 and paths of variance v has variance ~ (S c m^2 + 4 m v + 2 v^2 / S) / P,
//   least at S = (v / m) sqrt(2 / c).
// Errors are rare and large (c = 30 on the dungeon, 400 on the hotel), so that more points beat quieter ones.
// Repeat  a function of the scene and the bake's rays, never of time, so that reports repeat

#include <cstddef>
#include <cstdint>

#include "core/bake/error_stats.h"

namespace kiln {

struct Spending {
  static constexpr std::size_t kFewestPoints = 1024, kMostPoints = 16384;
  static constexpr int kPilotSamples = 16;

  std::size_t points = kFewestPoints;
  int samples = 256;
};

/// `pilot` is of kPilotSamples paths at each point. About 5 % of `bake_rays`, or more: about a second where an error
/// target hangs on it (`thorough`), else a tenth of one.
Spending plan_spending(const ErrorStats& pilot, double rays_per_path, std::uint64_t bake_rays, bool thorough);

}  // namespace kiln
