#include "core/grid/sphere_gather.h"

#include <algorithm>
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
constexpr double kUniform = std::numbers::inv_pi / 4;      // density of the sphere's rays

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
      sets_(0, rays, kSets, seed_, kFirstRays, Spread::sphere),
      emitters_(world.tracer.scene()) {
  if (content == GridContent::indirect || world.sky == nullptr) return;
  EnvironmentSampler sampler(*world.sky);
  if (sampler.useful()) bright_ = std::move(sampler);
}

GatheredLight SphereGather::at(const Vec3f& place, std::uint64_t item, std::uint64_t& rays) const {
  const LocalFrame frame = turned(sets_, seed_, item);
  Random random(seed_, item, 2);
  OctantSums sums;
  Seen seen;
  Rays16 packet;
  Hits16 hits;
  packet.ox.fill(place.x), packet.oy.fill(place.y), packet.oz.fill(place.z), packet.far.fill(kFar);
  for (int k = 0; k < sets_.samples() / kPacket; ++k) {
    if (seen.rays == kFirstRays && seen.nothing()) break;  // inside a solid
    sets_.turn(frame.set, k, frame.basis, packet);
    world_.tracer.closest16(packet, hits);
    rays += kPacket;
    seen.rays += kPacket;
    for (std::size_t i = 0; i < kPacket; ++i) {
      const Vec3f w{packet.dx[i], packet.dy[i], packet.dz[i]};
      const Hit hit{hits.t[i], hits.u[i], hits.v[i], hits.triangle[i], false};
      sums.add(w, look_along(w, hit, random, seen, rays));
    }
  }
  GatheredLight out{sums.vectors(kSphere / static_cast<float>(seen.rays)),
                    static_cast<float>(seen.backs) / static_cast<float>(seen.rays)};
  if (content_ == GridContent::all) {
    OctantSums direct;
    add_lamps(place, direct, rays);
    add_bright_sky(place, item, direct, rays);
    add_emitters(place, item, direct, rays);
    out.light += direct.vectors(1);
  }
  return out;
}

/// What one ray of the sphere brings.
Vec3f SphereGather::look_along(const Vec3f& w, const Hit& hit, Random& random, Seen& seen, std::uint64_t& rays) const {
  const bool all = content_ == GridContent::all;
  if (!hit) {
    ++seen.open;
    return all ? seen_sky(w) : Vec3f{};
  }
  if (world_.faces.side(hit.triangle, w) == HitSide::dark) {
    ++seen.backs;
    return {};
  }
  LitSurface::Reflected from{.light = {}, .known = true};
  if (world_.surface != nullptr) from = world_.surface->reflected(hit, w, random, rays);
  if (from.known) ++seen.open;
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
  for (int k = 0; k < sets_.samples(); ++k) {
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(k), mix64(seed_ ^ mix64(item ^ 0x736b79ULL)));
    const Vec3d w = bright_->sample({u.x, u.y});
    if (world_.tracer.occluded(place, to_float(w), kFar)) continue;
    const double share = 1 / (sets_.samples() * (kUniform + bright_->density(w)));
    sums.add(to_float(w), environment_radiance(*world_.sky, to_float(w)) * static_cast<float>(share));
  }
  rays += static_cast<std::uint64_t>(sets_.samples());
}

void SphereGather::add_emitters(const Vec3f& place, std::uint64_t item, OctantSums& sums, std::uint64_t& rays) const {
  if (emitters_.empty()) return;
  Random random(seed_, item, 3);
  for (int k = 0; k < sets_.samples(); ++k) {
    const double pick = (k + random.uniform_double()) / sets_.samples();
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
    sums.add(to_float(w), to_float(to.radiance / (sets_.samples() * (density + kUniform))));
  }
  rays += static_cast<std::uint64_t>(sets_.samples());
}

}  // namespace kiln
