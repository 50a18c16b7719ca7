#include "core/scene/bright_part.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln {
namespace {

double size_of(const Vec3f& x) { return (double{x.x} + double{x.y} + double{x.z}) / 3; }

/// Over all directions, of what is left where nothing is larger than `most`.
double mean_below(const Environment& e, double most) {
  double sum = 0, weights = 0;
  for (int y = 0; y < e.height; ++y) {
    const double weight = std::cos((0.5 - (y + 0.5) / e.height) * std::numbers::pi);
    for (int x = 0; x < e.width; ++x)
      sum += weight * std::min(most, size_of(e.radiance[static_cast<std::size_t>(y * e.width + x)]));
    weights += weight * e.width;
  }
  return sum / weights;
}

}  // namespace

Environment bright_part(const Environment& e) {
  constexpr int kRounds = 64;  // falls, by half or more while the sun is most of it
  double most = 1e300;
  for (int i = 0; i < kRounds; ++i) most = kBright * mean_below(e, most);
  Environment out = e;
  bool any = false;
  for (Vec3f& x : out.radiance) {
    const double size = size_of(x);
    any = any || size > most;
    x = size > most ? x * static_cast<float>(1 - most / size) : Vec3f{};
  }
  if (!any) out.width = out.height = 1, out.radiance = {Vec3f{}};
  return out;
}

}  // namespace kiln
