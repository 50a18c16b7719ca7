#include "core/grid/sphere_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/random.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr int kSets = 8;
constexpr float kSphere = 4 * std::numbers::pi_v<float>;  // its solid angle
constexpr double kUniform = std::numbers::inv_pi / 4;     // density of the sphere's rays

/// A random rotation: the local z axis anywhere, then any azimuth.
LocalFrame turned(const DirectionSets& sets, std::uint64_t seed, std::uint64_t item) {
  Random random(seed, item, 1);
  const double x = random.uniform_double(), y = random.uniform_double();
  return local_frame(sets, to_float(uniform_sphere(Vec2<double>{x, y})), seed, item);
}

}  // namespace

SphereGather::SphereGather(const World& world, GridContent content, int rays, std::uint64_t seed)
    : seed_(mix64(seed ^ 0x67726964ULL)),
      sets_(0, rays, kSets, seed_, std::max(0, (rays - 1) / kPacket * kPacket), Spread::sphere),
      light_(world, {.count = sets_.samples(), .density = kUniform, .direct = content == GridContent::all}, seed_) {}

GatheredLight SphereGather::at(const Vec3f& place, std::uint64_t item, std::uint64_t& rays) const {
  const LocalFrame frame = turned(sets_, seed_, item);
  Work work{Random(seed_, item, 2), {}, rays};
  Batch from;
  for (Rays16& packet : from)
    packet.ox.fill(place.x), packet.oy.fill(place.y), packet.oz.fill(place.z), packet.far.fill(kFar);
  const int packets = sets_.samples() / kPacket;
  trace_batch(frame, packets - 1, from, work);
  for (int first = 0; first < packets - 1 && (first == 0 || work.open > 0); first += kBatch)
    trace_batch(frame, first, from, work);
  GatheredLight out{work.sums.vectors(kSphere / static_cast<float>(work.sent)),
                    static_cast<float>(work.backs) / static_cast<float>(work.sent)};
  OctantSums lights;
  light_.visit_lights(place, item, rays, [&](const Vec3f& w, const Vec3f& light, float) { lights.add(w, light); });
  out.light += lights.vectors(1);
  return out;
}

/// Up to kBatch packets from `first` to the end of their round: all are traced before any hit is looked at, and all are
/// looked at before any light is read, so that what the hits need is in the cache.
void SphereGather::trace_batch(const LocalFrame& frame, int first, Batch& rays, Work& work) const {
  std::array<Hits16, kBatch> hits;
  const World& world = light_.world();
  const int last = sets_.samples() / kPacket - 1, end = first < last ? last : last + 1;
  const auto count = static_cast<std::size_t>(std::min(kBatch, end - first));
  for (std::size_t k = 0; k < count; ++k) {
    sets_.turn(frame.set, first + static_cast<int>(k), frame.basis, rays[k]);
    world.tracer.closest16(rays[k], hits[k]);
    for (std::size_t i = 0; i < kPacket; ++i) {
      const std::uint32_t triangle = hits[k].triangle[i];
      if (triangle != kNoHit && world.surface != nullptr) world.surface->prefetch(triangle);
    }
  }
  const int sent = static_cast<int>(count) * kPacket;
  work.sent += sent;
  work.rays += static_cast<std::uint64_t>(sent);
  const auto ray = [&](std::size_t at) {
    const std::size_t k = at / kPacket, i = at % kPacket;
    return std::pair<Vec3f, Hit>{{rays[k].dx[i], rays[k].dy[i], rays[k].dz[i]},
                                 {hits[k].t[i], hits[k].u[i], hits[k].v[i], hits[k].triangle[i], false}};
  };
  std::array<IncidentLight::Landing, std::size_t{kBatch} * kPacket> landings;
  for (std::size_t at = 0; at < count * kPacket; ++at) {
    const auto [w, hit] = ray(at);
    landings[at] = light_.look(w, hit);
  }
  for (std::size_t at = 0; at < count * kPacket; ++at) {
    const auto [w, hit] = ray(at);
    const IncidentLight::Seen seen = light_.along(w, hit, landings[at], work.random, work.rays);
    if (seen.met == IncidentLight::Met::back) ++work.backs;
    if (seen.met == IncidentLight::Met::sky || seen.met == IncidentLight::Met::lit) ++work.open;
    if (seen.light != Vec3f{}) work.sums.add(w, seen.light);
  }
}

}  // namespace kiln
