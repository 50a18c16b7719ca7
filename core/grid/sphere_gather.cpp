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
    : world_(world),
      content_(content),
      seed_(mix64(seed ^ 0x67726964ULL)),
      few_(0, std::min(rays, kFewRays), kSets, seed_, 0, Spread::sphere),
      more_(0, std::max(0, rays - few_.samples()), kSets, mix64(seed_), 0, Spread::sphere),
      emitters_(world.tracer.scene()) {
  if (content == GridContent::indirect || world.sky == nullptr) return;
  EnvironmentSampler sampler(*world.sky);
  if (sampler.useful()) bright_ = std::move(sampler);
}

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
  if (content_ == GridContent::all) {
    OctantSums direct;
    add_lamps(place, direct, rays);
    add_bright_sky(place, item, direct, rays);
    add_emitters(place, item, direct, rays);
    out.light += direct.vectors(1);
  }
  return out;
}

/// kBatch packets from `first` on: all are traced before any hit is looked at, so that what the hits need is in the
/// cache.
void SphereGather::trace_batch(const DirectionSets& sets, const LocalFrame& frame, int first, Rays16& from,
                               Work& work) const {
  std::array<Rays16, kBatch> rays;
  std::array<Hits16, kBatch> hits;
  const auto count = static_cast<std::size_t>(std::min(kBatch, sets.samples() / kPacket - first));
  for (std::size_t k = 0; k < count; ++k) {
    rays[k] = from;
    sets.turn(frame.set, first + static_cast<int>(k), frame.basis, rays[k]);
    world_.tracer.closest16(rays[k], hits[k]);
    for (std::size_t i = 0; i < kPacket; ++i) {
      const std::uint32_t triangle = hits[k].triangle[i];
      if (triangle == kNoHit) continue;
      if (world_.surface != nullptr) world_.surface->prefetch(triangle);
    }
  }
  const int sent = static_cast<int>(count) * kPacket;
  work.sent += sent;
  work.rays += static_cast<std::uint64_t>(sent);
  const auto each = [&](const auto& look) {
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < kPacket; ++i) {
        look(Vec3f{rays[k].dx[i], rays[k].dy[i], rays[k].dz[i]},
             Hit{hits[k].t[i], hits[k].u[i], hits[k].v[i], hits[k].triangle[i], false});
      }
    }
  };
  each([&](const Vec3f& w, const Hit& hit) { work.sums.add(w, look_along(w, hit, work)); });
}

/// What one ray of the sphere brings.
Vec3f SphereGather::look_along(const Vec3f& w, const Hit& hit, Work& work) const {
  const bool all = content_ == GridContent::all;
  if (!hit) {
    ++work.open;
    return all ? seen_sky(w) : Vec3f{};
  }
  if (world_.faces.side(hit.triangle, w) == HitSide::dark) {
    ++work.backs;
    return {};
  }
  LitSurface::Reflected from{.light = {}, .known = true};
  if (world_.surface != nullptr) from = world_.surface->reflected(hit, w, work.random, work.rays);
  if (from.known) ++work.open;
  return all ? from.light + seen_emitter(hit, w) : from.light;
}

Vec3f SphereGather::seen_sky(const Vec3f& w) const {
  if (world_.sky == nullptr) return {};
  const double balance = bright_ ? kUniform / (kUniform + bright_->density(to_double(w))) : 1;
  return environment_radiance(*world_.sky, w) * static_cast<float>(balance);
}

Vec3f SphereGather::seen_emitter(const Hit& hit, const Vec3f& w) const {
  const double per_area = emitters_.density(hit.triangle);
  if (!(per_area > 0)) return {};
  const SurfacePoint p = surface_point(world_.tracer.scene(), hit.triangle, hit.u, hit.v);
  const double facing = std::max(1e-12, std::abs(double{dot(w, p.geometric_normal)}));
  const double other = per_area * double{hit.t} * double{hit.t} / facing;
  return emission_at(world_.tracer.scene(), p) * static_cast<float>(kUniform / (kUniform + other));
}

void SphereGather::add_lamps(const Vec3f& place, OctantSums& sums, std::uint64_t& rays) const {
  for (const Light& light : world_.tracer.scene().lights) {
    const LightArrival arrival = light_arrival(light, to_double(place));
    if (arrival.irradiance == Vec3d{}) continue;
    ++rays;
    const Vec3f w = to_float(arrival.direction);
    const float far = std::isfinite(arrival.distance) ? static_cast<float>(arrival.distance) : kFar;
    if (!world_.tracer.occluded(place, w, far)) sums.add(w, to_float(arrival.irradiance));
  }
}

void SphereGather::add_bright_sky(const Vec3f& place, std::uint64_t item, OctantSums& sums, std::uint64_t& rays) const {
  if (!bright_) return;
  for (int k = 0; k < count(); ++k) {
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), mix64(seed_ ^ mix64(item ^ 0x736b79ULL)));
    const Vec3d w = bright_->sample({u.x, u.y});
    if (world_.tracer.occluded(place, to_float(w), kFar)) continue;
    const double share = 1 / (count() * (kUniform + bright_->density(w)));
    sums.add(to_float(w), environment_radiance(*world_.sky, to_float(w)) * static_cast<float>(share));
  }
  rays += static_cast<std::uint64_t>(count());
}

void SphereGather::add_emitters(const Vec3f& place, std::uint64_t item, OctantSums& sums, std::uint64_t& rays) const {
  if (emitters_.empty()) return;
  Random random(seed_, item, 3);
  for (int k = 0; k < count(); ++k) {
    const double pick = (k + random.uniform_double()) / count();
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), mix64(seed_ ^ mix64(item ^ 0x6c616d70ULL)));
    const EmitterSample to = emitters_.sample(pick, {u.x, u.y});
    const Vec3d way = to.position - to_double(place);
    const double distance2 = dot(way, way);
    const Vec3d w = normalized(way);
    const double facing = -dot(w, to.normal);
    if (!(distance2 > 0) || (to.double_sided ? facing == 0 : facing <= 0)) continue;
    const Vec3f end = offset_origin(to_float(to.position), to_float(facing < 0 ? -to.normal : to.normal)) - place;
    const float far = length(end);
    if (world_.tracer.occluded(place, normalized(end), far)) continue;
    const double density = to.density * distance2 / std::abs(facing);
    sums.add(to_float(w), to_float(to.radiance / (count() * (density + kUniform))));
  }
  rays += static_cast<std::uint64_t>(count());
}

}  // namespace kiln
