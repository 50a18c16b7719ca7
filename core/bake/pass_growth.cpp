#include "core/bake/pass_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace kiln {
namespace {

constexpr double kMostSamples = 8, kMostTriangles = 6;  // growth of one pass

double square(double x) { return x * x; }

/// What a pass costs, in shadow rays: it must not depend on a clock.
struct Parts {
  double direct, reflected, points, triangles;

  Parts(const PassRecord& pass, const PassKind& kind)
      : direct(static_cast<double>(pass.rays - pass.bounce_rays)),
        reflected(kind.gather_ray * static_cast<double>(pass.bounce_rays)),
        points(kind.point * static_cast<double>(pass.points)),
        triangles(kind.triangle * static_cast<double>(pass.triangles)) {}
  double all() const { return direct + reflected + points + triangles; }
};

}  // namespace

PassGrowth::PassGrowth(std::span<const PassRecord> passes, const PassKind& kind, const FixedKnobs& fixed)
    : passes_(passes), kind_(kind), fixed_(fixed) {}

/// Without points of their own the vertices, which are as the triangles, have the reflected rays.
double PassGrowth::cost(Growth g) const {
  const Parts parts(last(), kind_);
  if (parts.points == 0)
    return g.triangles * (parts.direct * g.direct + parts.reflected * g.reflected + parts.triangles) / parts.all();
  return (g.triangles * (parts.direct * g.direct + parts.triangles) +
          g.points * (parts.reflected * g.reflected + parts.points)) /
         parts.all();
}

/// From two passes of one order that differ in triangles; that of its kind until there are such.
double PassGrowth::interpolation_power() const {
  if (passes_.size() < 2) return kind_.power;
  const PassRecord& a = passes_[passes_.size() - 2];
  const PassRecord& b = last();
  if (a.order != b.order || !(b.sources.interpolation > 0) || !(a.sources.interpolation > 0)) return kind_.power;
  const double growth = std::log(static_cast<double>(b.triangles) / static_cast<double>(a.triangles));
  if (growth < 0.2) return kind_.power;
  return std::clamp(std::log(a.sources.interpolation / b.sources.interpolation) / growth, 0.25, 1.0);
}

/// The squared error of a pass that has grown.
double PassGrowth::predicted(Growth g) const {
  const ErrorSources& s = last().sources;
  const double reflected = square(s.noise_of_reflections), direct = square(s.noise) - reflected;
  return direct / g.direct + reflected / g.reflected +
         square(s.interpolation) * std::pow(g.triangles, -2 * interpolation_power()) + square(s.bounce_tail) +
         square(s.quantisation) + square(s.compression) + square(s.merging) +
         square(s.points) * std::pow(g.points, -2 * kind_.points_power);
}

/// The fewest rays that leave so much noise, by Lagrange: rays of each kind as the root of noise over cost.
Growth PassGrowth::rays_for(double noise, const Growth& places) const {
  Growth out = places;
  const ErrorSources& s = last().sources;
  const Parts cost(last(), kind_);
  const double dear = kind_.point > 0 ? places.points / places.triangles : 1;  // a reflected ray, beside a direct one
  const double reflected = square(s.noise_of_reflections), direct = std::max(0.0, square(s.noise) - reflected);
  const auto limited = [](double growth) { return std::clamp(growth, 1.0, kMostSamples); };
  out.direct = fixed_.direct ? 1 : kMostSamples, out.reflected = fixed_.reflected ? 1 : kMostSamples;
  if (noise <= 0 || (fixed_.direct && fixed_.reflected)) return out;
  const double reflected_cost = cost.reflected * dear;
  if (!fixed_.direct && !fixed_.reflected) {
    const double both = std::sqrt(direct * cost.direct) + std::sqrt(reflected * reflected_cost);
    const auto growth = [&](double own, double price) { return own > 0 ? std::sqrt(own / price) * both / noise : 0; };
    out.direct = limited(growth(direct, cost.direct)), out.reflected = limited(growth(reflected, reflected_cost));
  }
  if (!fixed_.reflected && (fixed_.direct || out.direct == 1))
    out.reflected = limited(noise > direct ? reflected / (noise - direct) : kMostSamples);
  if (!fixed_.direct && (fixed_.reflected || out.reflected == 1))
    out.direct = limited(noise > reflected ? direct / (noise - reflected) : kMostSamples);
  return out;
}

/// The cheapest growth that brings the error to `wanted`, or nearly as near to it as any.
Growth PassGrowth::towards(double wanted) const {
  constexpr int kSteps = 48, kPointSteps = 24;
  constexpr double kNearly = 1.25;  // of the squared error
  std::vector<Growth> all;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= (fixed_.triangles ? 0 : kSteps); ++i) {
    for (int k = 0; k <= (free_points() ? kPointSteps : 0); ++k) {
      Growth noiseless;
      noiseless.direct = noiseless.reflected = std::numeric_limits<double>::infinity();
      noiseless.triangles = std::pow(kMostTriangles, i / double{kSteps});
      noiseless.points = std::pow(kMostTriangles, k / double{kPointSteps});
      const Growth growth = rays_for(square(wanted) - predicted(noiseless), noiseless);
      least = std::min(least, predicted(growth));
      all.push_back(growth);
    }
  }
  const double near = std::max(square(wanted) * (1 + 1e-9), kNearly * least);
  std::erase_if(all, [&](const Growth& g) { return predicted(g) > near; });
  return *std::ranges::min_element(all, {}, [&](const Growth& g) { return cost(g); });
}

/// The lowest error that a cost of `most` buys.
Growth PassGrowth::within(double most) const {
  double cheap = std::max(last().relrmse, 1e-6), dear = cheap / 64;
  for (int i = 0; i < 32; ++i) {
    const double middle = std::sqrt(cheap * dear);
    (cost(towards(middle)) > most ? dear : cheap) = middle;
  }
  return towards(cheap);
}

PassRecord PassGrowth::imagined(Growth g) const {
  PassRecord out = last();
  const auto times = [](std::uint64_t count, double growth) {
    return static_cast<std::uint64_t>(static_cast<double>(count) * growth);
  };
  const double gatherers = out.points == 0 ? g.triangles : g.points;
  out.samples = static_cast<int>(out.samples * g.direct);
  out.bounce_samples = static_cast<int>(out.bounce_samples * g.reflected);
  out.bounce_rays = times(out.bounce_rays, gatherers * g.reflected);
  out.rays = out.bounce_rays + times(last().rays - last().bounce_rays, g.triangles * g.direct);
  out.triangles = times(out.triangles, g.triangles), out.vertices = times(out.vertices, g.triangles);
  out.points = times(out.points, g.points), out.gathered = times(out.gathered, g.points);
  out.seconds = out.certificate_seconds + out.work() * cost(g);
  out.elapsed_s += out.seconds;

  ErrorSources& s = out.sources;
  const double reflected = square(s.noise_of_reflections), direct = std::max(0.0, square(s.noise) - reflected);
  s.noise_of_reflections = std::sqrt(reflected / g.reflected);
  s.noise = std::sqrt(direct / g.direct + reflected / g.reflected);
  s.interpolation *= std::pow(g.triangles, -interpolation_power());
  s.points *= std::pow(g.points, -kind_.points_power);
  const double share = std::sqrt(predicted(g)) / std::max(out.relrmse, 1e-12);
  out.relrmse *= share, out.low *= share, out.high *= share;
  return out;
}

}  // namespace kiln
