#include "core/bake/direct_source.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"
#include "core/prt/hidden.h"

namespace kiln {
namespace {

/// Of the constant band at points.
double mean_constant_band(const Tracer& tracer, const std::vector<TransferPoint>& points, std::uint64_t seed,
                          Threads& threads) {
  constexpr int kPilot = 64;
  double sum = 0;
  for (const float t : bake_direct_transfer(tracer, points, {.order = 1, .samples = kPilot, .seed = seed}, threads))
    sum += t;
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

double mean_lamp_light(const Tracer& tracer, const std::vector<TransferPoint>& points, const FixedDirect& lamps,
                       Threads& threads) {
  double sum = 0;
  for (const Vec3f& x : bake_fixed_direct(tracer, points, lamps, threads)) sum += (double{x.x} + x.y + x.z) / 3;
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

}  // namespace

std::vector<TransferPoint> spread_points(const Mesh& mesh) {
  const std::vector<TransferPoint> all = vertex_points(mesh);
  std::vector<TransferPoint> some;
  for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / 1024) some.push_back(all[i]);
  return some;
}

TransferRays transfer_rays(const Tracer& tracer, const Plan& plan, const std::vector<double>& band_power,
                           std::uint64_t seed, Threads& threads) {
  TransferRays out{.sky = {.order = plan.order, .samples = plan.samples, .seed = seed},
                   .lamps = {.samples = plan.lamp_samples, .seed = seed}};
  if (!(plan.noise > 0)) return out;
  const std::vector<TransferPoint> points = spread_points(tracer.scene().mesh);
  const double sky = 2 * std::sqrt(M_PI) * mean_constant_band(tracer, points, seed, threads);
  const double noise = std::sqrt(2.0) * plan.noise;  // interpolation halves the variance of what vertices have
  out.sky.tolerance = static_cast<float>(noise * std::max(sky, 0.01));
  for (const double p : band_power) out.sky.band_power.push_back(static_cast<float>(p));
  if (!plan.lamps) return out;
  constexpr int kReach = 16;    // the damaged helmet: noise .61 without it, .02 to .05 with it
  constexpr double kLarge = 8;  // below it more rays for all points, not for a few, would lower the noise
  const double lamps = mean_lamp_light(tracer, points, out.lamps, threads);
  out.lamps.samples = (plan.lamp_samples + 15) / 16 * 16;
  out.lamps.reach = std::min(kReach, 65536 / out.lamps.samples);
  out.lamps.tolerance = static_cast<float>(kLarge * noise * lamps);
  return out;
}

TransferRays rough(TransferRays rays) {
  rays.sky.samples = std::max(16, rays.sky.samples / kRoughRays);
  rays.lamps.samples = std::max(16, rays.lamps.samples / kRoughRays / 16 * 16);
  return rays;
}

DirectSource::DirectSource(const Tracer& tracer, const Plan& plan, const TransferRays& rays,
                           const std::vector<double>& band_power, BakeLog& log, Threads& threads)
    : tracer_(tracer),
      plan_(plan),
      log_(log),
      threads_(threads),
      lamps_(rays.lamps),
      rough_lamps_(rough(rays).lamps),
      sky_(tracer, rays.sky),
      rough_sky_(tracer, rough(rays).sky),
      scale_(measure_scale(band_power)) {}

ValueSource DirectSource::source() {
  ValueSource s{
      .width = width(),
      .values = [this](std::span<const TransferPoint> batch) { return light(batch, sky_, lamps_); },
      .bounded = {lamp_columns()},
      .hidden = hidden_test(tracer_),
      .rough = [this](std::span<const TransferPoint> batch) { return light(batch, rough_sky_, rough_lamps_); }};
  if (plan_.lamps) s.bounded.insert(s.bounded.end(), {0, 1, 2});
  return s;
}

std::vector<float> DirectSource::measure_scale(const std::vector<double>& band_power) {
  EXPECTS(band_power.size() == static_cast<std::size_t>(plan_.order));
  constexpr double kFaint = 0.05;  // of an open point: a sky that reaches less counts as if it reached so much
  const std::vector<TransferPoint> points = spread_points(tracer_.scene().mesh);
  std::vector<float> scale(width(), 1.0F);
  if (plan_.lamps) {
    const double mean =
        mean_lamp_light(tracer_, points, {.samples = plan_.lamp_samples, .seed = lamps_.seed}, threads_);
    if (mean > 1e-30 && mean < 1e30) std::fill_n(scale.begin(), 3, static_cast<float>(kOpenConstantBand / mean));
  }
  if (plan_.subdivide.measure != SplitMeasure::residual) return scale;
  const double mean = mean_constant_band(tracer_, points, lamps_.seed, threads_);
  const double constant = kOpenConstantBand / std::max(mean, kFaint * kOpenConstantBand);
  for (int l = 0; l < plan_.order; ++l) {
    const double band = constant * std::sqrt(band_power[static_cast<std::size_t>(l)] / band_power[0]);
    std::fill_n(scale.begin() + static_cast<std::ptrdiff_t>(lamp_columns()) + l * l, 2 * l + 1,
                static_cast<float>(band));
  }
  return scale;
}

std::vector<float> DirectSource::light(std::span<const TransferPoint> batch, const DirectTransferBaker& baker,
                                       const FixedDirect& lamps) {
  points_ += batch.size();
  log_.advance(std::min(points_, expected_points()), expected_points());
  const std::vector<float> sky = baker.bake(batch, threads_, &stats_);
  if (!plan_.lamps) return join(sky, {});
  return join(sky, bake_fixed_direct(tracer_, batch, lamps, threads_, &stats_));
}

std::vector<float> DirectSource::join(const std::vector<float>& sky, const std::vector<Vec3f>& lamps) const {
  const std::size_t points = sky.size() / bands();
  std::vector<float> joined(points * width(), 0.0F);
  for (std::size_t p = 0; p < points; ++p) {
    float* row = joined.data() + p * width();
    for (std::size_t c = 0; c < 3 && plan_.lamps; ++c) row[c] = lamps[p][c];
    std::copy_n(sky.data() + p * bands(), bands(), row + lamp_columns());
    for (std::size_t i = 0; i < width(); ++i) row[i] *= scale_[i];
  }
  return joined;
}

void DirectSource::separate(const std::vector<float>& joined, std::vector<float>& sky,
                            std::vector<Vec3f>& lamps) const {
  const std::size_t points = joined.size() / width();
  sky.resize(points * bands());
  lamps.resize(plan_.lamps ? points : 0);
  for (std::size_t p = 0; p < points; ++p) {
    const float* row = joined.data() + p * width();
    const auto value = [&](std::size_t i) { return row[i] / scale_[i]; };
    for (std::size_t i = 0; i < bands(); ++i) sky[p * bands() + i] = value(lamp_columns() + i);
    if (plan_.lamps) lamps[p] = {value(0), value(1), value(2)};
  }
}

/// Subdivision asks for three points a final triangle, unless its threshold ends it early.
std::uint64_t DirectSource::expected_points() const {
  return plan_.split ? 3 * plan_.subdivide.triangles : tracer_.scene().mesh.position.size();
}

}  // namespace kiln
