#include "core/meshless/direct_light.h"

#include <algorithm>
#include <numbers>

#include "core/base/random.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

/// Sends the rays of up to sixteen directions; bit i is set where ray i meets something.
std::uint32_t blocked(const Tracer& tracer, const Vec3f& origin, const std::array<Vec3f, kPacket>& w, int count) {
  Rays16 rays;
  rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    rays.dx[i] = w[i].x, rays.dy[i] = w[i].y, rays.dz[i] = w[i].z;
  }
  return tracer.occluded16(rays, count);
}

}  // namespace

DirectLight::DirectLight(const Tracer& tracer, const Environment* sky)
    : tracer_(tracer), lamps_(tracer), flat_(FlatLamps::find(tracer)), sky_(sky) {
  if (sky_ == nullptr) return;
  EnvironmentSampler sampler(*sky_);
  if (sampler.useful()) bright_ = std::move(sampler);
}

Vec3f DirectLight::at(const Receiver& to, const DirectRays& budget, std::uint64_t seed, std::uint64_t& rays) const {
  Vec3f light;
  if (!lamps_.none()) {
    light += lamps_.punctual(to);
    rays += tracer_.scene().lights.size();
    if (flat_) {
      light += flat_->light_at(to, budget.lamps, seed, rays);
    } else {
      light += lamps_.emitted(to, budget.lamps.many, seed);
      rays += static_cast<std::uint64_t>(budget.lamps.many + cosine_share(budget.lamps.many));
    }
  }
  if (sky_ != nullptr) light += sky_at(to, budget.sky, mix64(~seed), rays);
  return light;
}

Vec3f DirectLight::sky_at(const Receiver& to, int samples, std::uint64_t seed, std::uint64_t& rays) const {
  const Basis<float> basis = basis_around(to.normal);
  Vec3d sum;
  std::array<Vec3f, kPacket> w;
  for (int first = 0; first < samples; first += kPacket) {
    const int count = std::min(kPacket, samples - first);
    for (int i = 0; i < count; ++i) {
      const Vec2f u = sobol_owen(static_cast<std::uint32_t>(first + i), seed);
      w[static_cast<std::size_t>(i)] = normalized(basis.to_world(cosine_hemisphere(u)), to.normal);
    }
    const std::uint32_t stopped = blocked(tracer_, to.origin, w, count);
    for (int i = 0; i < count; ++i) {
      if ((stopped >> i & 1U) != 0) continue;
      const Vec3f& d = w[static_cast<std::size_t>(i)];
      const double own = std::max(1e-12, double{dot(d, to.normal)}) * std::numbers::inv_pi;
      const double balance = bright_ ? own / (own + bright_->density(to_double(d))) : 1;
      sum += to_double(environment_radiance(*sky_, d)) * balance;
    }
  }
  rays += static_cast<std::uint64_t>(samples);
  if (bright_) {
    for (int first = 0; first < samples; first += kPacket) {
      const int count = std::min(kPacket, samples - first);
      for (int i = 0; i < count; ++i) {
        const Vec2f u = sobol_owen(static_cast<std::uint32_t>(first + i), ~seed);
        w[static_cast<std::size_t>(i)] = to_float(bright_->sample({u.x, u.y}));
      }
      const std::uint32_t stopped = blocked(tracer_, to.origin, w, count);
      for (int i = 0; i < count; ++i) {
        const Vec3f& d = w[static_cast<std::size_t>(i)];
        const double own = dot(d, to.normal) * std::numbers::inv_pi;
        if ((stopped >> i & 1U) != 0 || own <= 0) continue;
        sum += to_double(environment_radiance(*sky_, d)) * (own / (own + bright_->density(to_double(d))));
      }
    }
    rays += static_cast<std::uint64_t>(samples);
  }
  return to_float(sum / samples);
}

}  // namespace kiln
