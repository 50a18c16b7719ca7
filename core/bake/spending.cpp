#include "core/bake/spending.h"

#include <algorithm>
#include <cmath>

namespace kiln {

Spending plan_spending(const ErrorStats& pilot, double rays_per_path, std::uint64_t bake_rays, bool thorough) {
  constexpr double kShare = 0.05, kSingleRay = 6;  // a ray of a path costs six of a packet: measured on the scenes
  constexpr double kTenthSecond = 128 * Spending::kFewestPoints, kSecond = 1536 * Spending::kFewestPoints,
                   kMostPaths = 4096 * Spending::kFewestPoints;
  constexpr double kSpread = 30;  // c: measured on the scenes
  // Noise has rare large errors of its own (paths that find a lamp by chance), which a pilot does not see: with 11
  // paths a point the hotel, whose error is .4, was estimated as 0 with an interval up to .44.
  constexpr double kFewestSamples = 32;
  // Where a promise hangs on it, enough points to meet some of the errors of a thousandth of the surface.
  const double fewest = thorough ? 4.0 * Spending::kFewestPoints : 1.0 * Spending::kFewestPoints;
  const double paths = std::clamp(kShare * static_cast<double>(bake_rays) / (kSingleRay * rays_per_path),
                                  thorough ? kSecond : kTenthSecond, kMostPaths);
  const double one_path = pilot.noise * pilot.noise * Spending::kPilotSamples;  // its variance
  const double wanted = pilot.relrmse > 0 ? one_path / (pilot.relrmse * pilot.relrmse) * std::sqrt(2 / kSpread) : paths;
  Spending out;
  out.samples = static_cast<int>(std::clamp(wanted, kFewestSamples, paths / fewest));
  out.points = static_cast<std::size_t>(std::clamp(paths / out.samples, fewest, double{Spending::kMostPoints}));
  // What no point takes goes into paths: a pilot knows the error to a factor only.
  out.samples = std::max(out.samples, static_cast<int>(paths / static_cast<double>(out.points)));
  return out;
}

}  // namespace kiln
