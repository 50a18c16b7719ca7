#pragma once
// The one definition of error: how far a bake is from the reference.
//   relRMSE = sqrt( mean (x - ref)^2 - noise ) / mean |ref|
// over points, lightings and RGB, each lighting scaled to a mean |ref| of 1 first, so that none dominates. `noise` is
// the variance of the reference's own estimate; subtracting it makes the figure unbiased. Paper   the interval is
// Efron's bias-corrected and accelerated bootstrap (1987) over points Shape   lighting * points + point, in all arrays
// Cost    points x lightings x resamples additions; at most about a second
// Repeat  same bits for the same seed
// Of rms  the same relative to the root of mean ref^2 - noise: a lamp that lights one room of many has a small mean and
// large values.
// Dark    A lighting whose reference is zero everywhere is scaled by the mean |x| instead (every light in it is wrong,
// so
//         its error is at least 1); where x is zero too it has error 0 by definition and counts in `dark_lightings`.

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

struct ErrorInput {
  std::span<const Vec3d> values;         // what the bake shows
  std::span<const Vec3d> reference;      // same size
  std::span<const Vec3d> noise;          // variance of each reference value, per channel; empty: the reference is exact
  std::size_t points = 0;                // values.size() = lightings * points
  std::span<const double> weights = {};  // of the points, where they are not drawn evenly; empty: all alike
  bool of_rms = false;                   // relative to the reference's root mean square instead of its mean
};

struct Bootstrap {
  std::uint64_t seed = 0;
  int resamples = 1000;  // fewer where points x lightings are so many that this would take seconds, never below 200
};

struct ErrorStats {
  double relrmse = 0;
  double interval_low = 0, interval_high = 0;  // 95 %
  double relrmse_without_worst_1pct = 0;       // the points of largest squared error left out, at least one of them
  double p99 = 0, max = 0;                     // of |x - ref| / mean |ref|, over points, lightings and channels
  double bias = 0;                             // mean (x - ref) / mean |ref|
  double noise = 0;                            // relRMSE of the reference against itself: what was subtracted
  std::size_t points = 0;
  int lightings = 0, dark_lightings = 0;
  std::vector<double> by_lighting;  // relRMSE of each lighting alone
};

/// All figures of one bake. No points: all zero.
ErrorStats compute_error(const ErrorInput&, const Bootstrap& = {});

/// Variance of the mean of two independent halves: ((a - b) / 2)^2.
std::vector<Vec3d> noise_from_halves(std::span<const Vec3d> half_a, std::span<const Vec3d> half_b);

}  // namespace kiln
