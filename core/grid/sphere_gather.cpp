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
      few_(0, std::min(rays, kFewRays), kSets, seed_, 0, Spread::sphere),
      more_(0, std::max(0, rays - few_.samples()), kSets, mix64(seed_), 0, Spread::sphere),
      light_(world,
             {.count = few_.samples() + more_.samples(), .density = kUniform, .direct = content == GridContent::all},
             seed_) {}

GatheredLight SphereGather::at(const Vec3f& place, std::uint64_t item, std::uint64_t& rays) const {
  const LocalFrame frame = turned(few_, seed_, item);
  Work work{Random(seed_, item, 2), {}, rays};
  Rays16 from;
  from.ox.fill(place.x), from.oy.fill(place.y), from.oz.fill(place.z), from.far.fill(kFar);
  trace_batch(few_, frame, 0, from, work);
  // Rays lie along a curve, so that packets of the large set are narrow; where nothing is seen, inside solids, none go.
  for (int first = 0; first < more_.samples() / kPacket && work.open > 0; first += kBatch)
    trace_batch(more_, frame, first, from, work);
  GatheredLight out{work.sums.vectors(kSphere / static_cast<float>(work.sent)),
                    static_cast<float>(work.backs) / static_cast<float>(work.sent)};
  OctantSums lights;
  light_.visit_lights(place, item, rays, [&](const Vec3f& w, const Vec3f& light, float) { lights.add(w, light); });
  out.light += lights.vectors(1);
  return out;
}

/// kBatch packets from `first` on: all are traced before any hit is looked at, so that what the hits need is in the
/// cache.
void SphereGather::trace_batch(const DirectionSets& sets, const LocalFrame& frame, int first, Rays16& from,
                               Work& work) const {
  std::array<Rays16, kBatch> rays;
  std::array<Hits16, kBatch> hits;
  const World& world = light_.world();
  const auto count = static_cast<std::size_t>(std::min(kBatch, sets.samples() / kPacket - first));
  for (std::size_t k = 0; k < count; ++k) {
    rays[k] = from;
    sets.turn(frame.set, first + static_cast<int>(k), frame.basis, rays[k]);
    world.tracer.closest16(rays[k], hits[k]);
    for (std::size_t i = 0; i < kPacket; ++i) {
      const std::uint32_t triangle = hits[k].triangle[i];
      if (triangle != kNoHit && world.surface != nullptr) world.surface->prefetch(triangle);
    }
  }
  const int sent = static_cast<int>(count) * kPacket;
  work.sent += sent;
  work.rays += static_cast<std::uint64_t>(sent);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < kPacket; ++i) {
      const Vec3f w{rays[k].dx[i], rays[k].dy[i], rays[k].dz[i]};
      const Hit hit{hits[k].t[i], hits[k].u[i], hits[k].v[i], hits[k].triangle[i], false};
      const IncidentLight::Seen seen = light_.along(w, hit, work.random, work.rays);
      if (seen.met == IncidentLight::Met::back) ++work.backs;
      if (seen.met == IncidentLight::Met::sky || seen.met == IncidentLight::Met::lit) ++work.open;
      work.sums.add(w, seen.light);
    }
  }
}

}  // namespace kiln
