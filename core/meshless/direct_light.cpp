#include "core/meshless/direct_light.h"

#include <algorithm>
#include <bit>
#include <numbers>

#include "core/base/random.h"
#include "core/base/shared_loop.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr int kSets = 8;

}  // namespace

DirectLight::DirectLight(const Tracer& tracer, const Environment* sky, const DirectRays& budget)
    : tracer_(tracer),
      lamps_(tracer),
      flat_(FlatLamps::find(tracer)),
      sky_(sky),
      budget_(budget),
      sets_(0, sky == nullptr ? 0 : budget.sky, kSets, 1) {
  if (sky_ == nullptr) return;
  EnvironmentSampler sampler(*sky_);
  if (sampler.useful()) bright_ = std::move(sampler);
}

Vec3f DirectLight::at(const Receiver& to, std::uint64_t seed, std::uint64_t& rays) const {
  Vec3f light;
  if (!lamps_.none()) {
    const LampRays& lamps = budget_.lamps;
    light += lamps_.punctual(to);
    rays += tracer_.scene().lights.size();
    if (flat_) {
      light += flat_->light_at(to, lamps, seed, rays);
    } else {
      light += lamps_.emitted(to, {.samples = lamps.many}, seed, rays);
    }
  }
  if (sky_ != nullptr) light += sky_at(to, mix64(~seed), rays);
  return light;
}

Vec3f DirectLight::sky_at(const Receiver& to, std::uint64_t seed, std::uint64_t& rays) const {
  const bool constant = sky_->width == 1 && sky_->height == 1;
  const Vec3f everywhere = environment_radiance(*sky_, {0, 1, 0});
  const double samples = sets_.samples();
  Vec3d sum;
  Rays16 packet;
  packet.ox.fill(to.origin.x), packet.oy.fill(to.origin.y), packet.oz.fill(to.origin.z), packet.far.fill(kFar);

  const LocalFrame frame = local_frame(sets_, to.normal, seed, 0);
  for (int k = 0; k < sets_.samples() / kPacket; ++k) {
    sets_.turn(frame.set, k, frame.basis, packet);
    const std::uint32_t stopped = tracer_.occluded16(packet);
    rays += kPacket;
    if (constant) {
      sum += to_double(everywhere) * static_cast<double>(kPacket - std::popcount(stopped));
      continue;
    }
    for (std::size_t i = 0; i < kPacket; ++i) {
      if ((stopped >> i & 1U) != 0) continue;
      const Vec3f w{packet.dx[i], packet.dy[i], packet.dz[i]};
      const double own = std::max(1e-12, double{dot(w, to.normal)}) * std::numbers::inv_pi;
      const double balance = bright_ ? own / (own + bright_->density(to_double(w))) : 1;
      sum += to_double(environment_radiance(*sky_, w)) * balance;
    }
  }
  if (bright_) {
    for (int first = 0; first < sets_.samples(); first += kPacket) {
      for (std::size_t i = 0; i < kPacket; ++i) {
        const Vec2f u = sobol_owen(static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(i), seed);
        const Vec3f w = to_float(bright_->sample({u.x, u.y}));
        packet.dx[i] = w.x, packet.dy[i] = w.y, packet.dz[i] = w.z;
      }
      const std::uint32_t stopped = tracer_.occluded16(packet);
      rays += kPacket;
      for (std::size_t i = 0; i < kPacket; ++i) {
        const Vec3f w{packet.dx[i], packet.dy[i], packet.dz[i]};
        const double own = dot(w, to.normal) * std::numbers::inv_pi;
        if ((stopped >> i & 1U) != 0 || own <= 0) continue;
        sum += to_double(environment_radiance(*sky_, w)) * (own / (own + bright_->density(to_double(w))));
      }
    }
  }
  return to_float(sum / samples);
}

std::vector<Vec3f> light_at(std::span<const TransferPoint> points, const DirectLight& light, std::uint64_t seed,
                            std::uint64_t& rays, Threads& threads) {
  std::vector<Vec3f> out(points.size());
  if (light.none()) return out;
  constexpr std::size_t kBlock = 128;
  const std::vector<std::uint32_t> order = morton_order_of(points);
  BlockCounts sent(points.size(), kBlock);
  run_loop({.name = "direct light",
            .items = points.size(),
            .block = kBlock,
            .body =
                [&](std::size_t begin, std::size_t end) {
                  std::uint64_t own = 0;
                  for (std::size_t i = begin; i < end; ++i) {
                    const TransferPoint& p = points[order[i]];
                    out[order[i]] = light.at({ray_origin(p), p.normal}, mix64(seed ^ point_key(p)), own);
                  }
                  sent.at(begin) = own;
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  for (std::size_t i = begin; i < end; ++i) stream.pass(out[order[i]]);
                  sent.pass(begin, end, stream);
                }},
           threads);
  rays += sent.sum();
  return out;
}

}  // namespace kiln
