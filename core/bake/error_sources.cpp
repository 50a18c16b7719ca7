#include "core/bake/error_sources.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/bake/lightings.h"

namespace kiln {
namespace {

constexpr double kInterpolated = 0.5;  // mean of (1-u-v)^2 + u^2 + v^2 over a triangle: three independent vertices

double square(double x) { return x * x; }
double root(double squared) { return std::sqrt(std::max(0.0, squared)); }

/// Squared values of rows of RGB coefficients under each judged lighting.
class Judged {
 public:
  Judged(const Certificate& certificate, const BakedScene& decoded)
      : transfer_(decoded.transfer),
        all_(decoded.transfer.order > 0 ? test_lightings(decoded.transfer.order, decoded.light) : Lightings{}),
        certificate_(certificate) {}

  /// Mean over the judged lightings of squared(light) / mean_light^2; light[i] of a channel, the lamps' slot last.
  template <class Squared>
  double mean(const Squared& squared) const {
    double sum = 0;
    std::size_t lit = 0;
    for (std::size_t k = 0; k < certificate_.lightings.size(); ++k) {
      if (!(certificate_.mean_light[k] > 0)) continue;
      double rgb = 0;
      for (std::size_t c = 0; c < 3; ++c) rgb += squared(weights(certificate_.lightings[k], c), c) / 3;
      sum += rgb / square(certificate_.mean_light[k]);
      ++lit;
    }
    return lit > 0 ? sum / static_cast<double>(lit) : 0;
  }

 private:
  std::vector<double> weights(const std::string& name, std::size_t channel) const {
    std::vector<double> out(static_cast<std::size_t>(transfer_.slots()), 0.0);
    const auto found = std::ranges::find(all_.names, name);
    if (found == all_.names.end()) {
      out.back() = 1;  // the lamps, or of order 0 all of the job's light
      return out;
    }
    const auto& sh = all_.sh[static_cast<std::size_t>(found - all_.names.begin())];
    for (std::size_t i = 0; i < sh.size(); ++i) out[i] = sh[i][channel];
    return out;
  }

  const Transfer& transfer_;
  Lightings all_;
  const Certificate& certificate_;
};

/// Mean squared light of the differences.
double squared(const Judged& judged, const Probes& probes, std::size_t slots) {
  if (probes.vertices.empty()) return 0;
  return judged.mean([&](const std::vector<double>& weight, std::size_t c) {
    double sum = 0;
    for (std::size_t p = 0; p < probes.vertices.size(); ++p) {
      const float* d = probes.difference.data() + (3 * p + c) * slots;
      double value = 0;
      for (std::size_t i = 0; i < slots; ++i) value += weight[i] * d[i];
      sum += square(value);
    }
    return sum / static_cast<double>(probes.vertices.size());
  });
}

}  // namespace

ErrorSources split_error(const Certificate& certificate, const BakedScene& decoded, const KnownErrors& known) {
  const Judged judged(certificate, decoded);
  const auto slots = static_cast<std::size_t>(decoded.transfer.slots());
  const auto of_one_draw = [&](const Probes& twice) { return kInterpolated * squared(judged, twice, slots) / 2; };
  const double direct = of_one_draw(known.noise.direct), reflected = of_one_draw(known.noise.reflected),
               rays = direct + reflected;
  const double steps = kInterpolated * squared(judged, known.storage.rounding, slots);
  const double rest = squared(judged, known.storage.left_out, slots);  // alike at a triangle's corners
  ErrorSources out{.noise = root(rays),
                   .noise_of_reflections = root(reflected),
                   .bounce_tail = known.tail_left,
                   .quantisation = root(steps),
                   .compression = root(rest)};
  const double left =
      std::max(0.0, square(certificate.transport.relrmse) - rays - steps - rest - square(known.tail_left));
  out.merging = std::min(known.merging, root(left));  // an estimate, and half of it is seen again by the next vertices
  const double read = judged.mean([&](const std::vector<double>&, std::size_t) { return known.points_squared; });
  out.points = std::min(root(read), root(left - square(out.merging)));
  out.interpolation = root(left - square(out.merging) - square(out.points));
  if (certificate.job_light && !certificate.transport.by_lighting.empty()) {
    const auto own = std::ranges::find(certificate.lightings, decoded.light.name);
    const bool known = own != certificate.lightings.end() && !decoded.light.coefficients.empty();
    const double held =
        known ? certificate.transport.by_lighting[static_cast<std::size_t>(own - certificate.lightings.begin())] : 0;
    if (known) out.truncation = root(square(certificate.job_light->relrmse) - square(held));
  }
  return out;
}

}  // namespace kiln
