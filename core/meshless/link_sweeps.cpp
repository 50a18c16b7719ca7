#include "core/meshless/link_sweeps.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr double kMostUnsteady = 0.9;  // factor that is believed when it has not become steady

}  // namespace

double light_over_area(std::span<const Vec3f> light, std::span<const float> area) {
  EXPECTS(light.size() >= area.size());
  double sum = 0;
  for (std::size_t s = 0; s < area.size(); ++s) sum += mean_of(light[s]) * area[s];
  return sum;
}

double count_sweeps(LightLinks& links, std::span<const float> area, const std::vector<std::vector<Vec3f>>& lamps,
                    int bounces) {
  links.tail = 0;
  if (bounces > 0) {
    links.sweeps = static_cast<std::uint32_t>(bounces - 1);
    return 0;
  }
  links.sweeps = 1;                              // one at a time: x' = e + T x is e' = x - e carried on
  std::vector<std::vector<Vec3f>> step = lamps;  // the newest power of T on each lamp
  std::vector<double> scale;                     // each lamp counts as much
  double light = 0, size_before = 0, ratio_before = 0, ratio = 0, left = 0;
  for (const auto& e : lamps) {
    const double own = light_over_area(e, area);
    scale.push_back(own > 0 ? 1 / own : 0);
    light += scale.back() * own;
  }
  int sweeps = 0;
  while (light > 0 && sweeps < kMostLinkSweeps) {
    double size = 0;
    for (std::size_t k = 0; k < step.size(); ++k) {
      const std::vector<Vec3f> next = solve_nodes(links, step[k]);
      for (std::size_t s = 0; s < area.size(); ++s) step[k][s] = next[s] - step[k][s];
      size += scale[k] * light_over_area(step[k], area);
    }
    ++sweeps;
    light += size;
    ratio = size_before > 0 ? std::clamp(size / size_before, 0.0, 0.999) : 0;
    const double rest = size * ratio / (1 - ratio);
    const double doubt = rest * std::min(1.0, std::abs(ratio - ratio_before) / (1 - ratio));
    left = rest / light;
    if (!(size > 0) || (sweeps >= kFewestLinkSweeps && doubt <= kLinkTail * light)) break;
    size_before = size, ratio_before = ratio;
  }
  links.sweeps = static_cast<std::uint32_t>(sweeps);
  if (sweeps == kMostLinkSweeps) ratio = std::min(ratio, kMostUnsteady);
  links.tail = static_cast<float>(ratio / (1 - ratio));
  return left;
}

}  // namespace kiln
