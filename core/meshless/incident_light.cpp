#include "core/meshless/incident_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr int kBrightSets = 64;

}  // namespace

IncidentLight::IncidentLight(const World& world, const Rays& own, std::uint64_t seed)
    : world_(world), own_(own), seed_(seed), emitters_(world.tracer.emitters()) {
  if (!own.direct || world.sky == nullptr) return;
  EnvironmentSampler sampler(*world.sky);
  if (sampler.useful()) bright_ = std::move(sampler);
  draw_bright_rays();
  if (own.blurred && bright_) blurred_ = blurred_sky();
}

void IncidentLight::draw_bright_rays() {
  if (!bright_) return;
  const int half = (own_.count + 1) / 2;
  for (int set = 0; set < kBrightSets; ++set) {
    std::vector<std::pair<std::uint32_t, BrightRay>> rays;  // by half, and along a curve: packets are narrow
    for (int k = 0; k < own_.count; ++k) {
      const Vec2f u =
          sobol_owen(static_cast<std::uint32_t>(k), mix64(seed_ ^ 0x736b79ULL ^ static_cast<unsigned>(set)));
      const Vec3d w = bright_->sample({u.x, u.y});
      const double share = 1 / (own_.count * (own_.density + bright_->density(w)));
      const Vec3f light = environment_radiance(*world_.sky, to_float(w)) * static_cast<float>(share);
      rays.push_back({morton_code(u) >> 1 | (k < half ? 0U : 1U << 31), {to_float(w), light, place_of(k)}});
    }
    std::ranges::stable_sort(rays, {}, [](const auto& ray) { return ray.first; });
    for (const auto& ray : rays) bright_rays_.push_back(ray.second);
  }
}

/// The sky as rays see it, at a resolution of one texel for each.
Environment IncidentLight::blurred_sky() const {
  constexpr int kFinest = 512;
  const double texels = 4 * std::numbers::pi * own_.density * own_.count;
  const int height = std::clamp(static_cast<int>(std::lround(std::sqrt(texels / 2))), 4, kFinest);
  return averaged_sky(height, std::max(2, kFinest / height), [this](const Vec3f& w) { return balanced_sky(w); });
}

void IncidentLight::visit_lights(const Vec3f& place, std::uint64_t item, std::uint64_t& rays,
                                 const Visit& visit) const {
  visit_punctual(place, rays, [&](std::size_t, const Vec3f& w, const Vec3f& light) { visit(w, light, -1); });
  visit_emitters(place, item, rays, visit);
  visit_bright_sky(place, item, rays, [&](const Vec3f& w, const Vec3f& light, float at, bool seen) {
    if (seen) visit(w, light, at);
  });
}

Vec3f IncidentLight::balanced_sky(const Vec3f& w) const {
  const double balance = bright_ ? own_.density / (own_.density + bright_->density(to_double(w))) : 1;
  return environment_radiance(*world_.sky, w) * static_cast<float>(balance);
}

Vec3f IncidentLight::sky_along(const Vec3f& w) const {
  if (world_.sky == nullptr || !own_.direct) return {};
  return blurred_ ? environment_radiance(*blurred_, w) : balanced_sky(w);
}

Vec3f IncidentLight::seen_emitter(const Hit& hit, const Vec3f& w) const {
  const double per_area = emitters_.density(hit.triangle);
  if (!(per_area > 0)) return {};
  const SurfacePoint p = surface_point(world_.tracer.scene(), hit.triangle, hit.u, hit.v);
  const double facing = std::max(1e-12, std::abs(double{dot(w, p.geometric_normal)}));
  const double other = per_area * double{hit.t} * double{hit.t} / facing;
  return emission_at(world_.tracer.scene(), p) * static_cast<float>(own_.density / (own_.density + other));
}

void IncidentLight::visit_punctual(const Vec3f& place, std::uint64_t& rays, const LampVisit& visit) const {
  const std::vector<Light>& lights = world_.tracer.scene().lights;
  for (std::size_t k = 0; own_.direct && k < lights.size(); ++k) {
    const LightArrival arrival = light_arrival(lights[k], to_double(place));
    if (arrival.irradiance == Vec3d{}) continue;
    ++rays;
    const Vec3f w = to_float(arrival.direction);
    const float far = std::isfinite(arrival.distance) ? static_cast<float>(arrival.distance) : kFar;
    if (!world_.tracer.occluded(place, w, far)) visit(k, w, to_float(arrival.irradiance));
  }
}

void IncidentLight::visit_bright_sky(const Vec3f& place, std::uint64_t item, std::uint64_t& rays,
                                     const SkyVisit& visit) const {
  if (!bright_) return;
  const auto count = static_cast<std::size_t>(own_.count);
  const BrightRay* set = &bright_rays_[count * (mix64(seed_ ^ mix64(item ^ 0x736b79ULL)) % kBrightSets)];
  Rays16 packet;
  packet.ox.fill(place.x), packet.oy.fill(place.y), packet.oz.fill(place.z), packet.far.fill(kFar);
  for (std::size_t first = 0; first < count; first += kPacket) {
    const std::size_t n = std::min<std::size_t>(kPacket, count - first);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3f& w = set[first + i].w;
      packet.dx[i] = w.x, packet.dy[i] = w.y, packet.dz[i] = w.z;
    }
    const std::uint32_t hidden = world_.tracer.occluded16(packet, static_cast<int>(n));
    for (std::size_t i = 0; i < n; ++i) {
      const BrightRay& ray = set[first + i];
      visit(ray.w, ray.light, ray.place, (hidden >> i & 1U) == 0);
    }
  }
  rays += count;
}

void IncidentLight::visit_emitters(const Vec3f& place, std::uint64_t item, std::uint64_t& rays,
                                   const Visit& visit) const {
  if (!own_.direct || emitters_.empty()) return;
  Random random(seed_, item, 3);
  for (int k = 0; k < own_.count; ++k) {
    const double pick = (k + random.uniform_double()) / own_.count;
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
    visit(to_float(w), to_float(to.radiance / (own_.count * (density + own_.density))), place_of(k));
  }
  rays += static_cast<std::uint64_t>(own_.count);
}

}  // namespace kiln
