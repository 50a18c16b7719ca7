#include "core/prt/bright_spots.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr double kBright = 4;                 // times the mean
constexpr float kBeyond = 1.01F;              // the longest of some thousand beams is not the longest of all
constexpr std::uint32_t kBeamsOfLamp = 8192;  // traced; few scenes have as many as a hundred lamps
constexpr float kInversePi = std::numbers::inv_pi_v<float>;
constexpr float kShortfall = 1 - 4e-6F;  // a shadow ray ends this fraction before what it looks at

double mean_of(const Vec3f& c) { return (double{c.x} + c.y + c.z) / 3; }

}  // namespace

BrightSpots::BrightSpots(const Tracer& tracer, double mean_light, std::uint64_t seed) : tracer_(tracer) {
  find_lamps(mean_light);
  trace_beams(seed);
  sort_beams();
}

void BrightSpots::find_lamps(double mean_light) {
  for (const Light& light : tracer_.scene().lights) {
    if (light.type == LightType::directional || !(mean_of(light.intensity) > 0)) continue;
    const double reach2 = mean_of(light.intensity) / (std::numbers::pi * kBright * std::max(mean_light, 1e-30));
    if (reach2 > 0) lamps_.push_back({&light, static_cast<float>(std::min(std::sqrt(reach2), double{kFar}))});
  }
}

void BrightSpots::trace_beams(std::uint64_t seed) {
  for (std::size_t k = 0; k < lamps_.size(); ++k) {
    float farthest = 0;
    for (std::uint32_t i = 0; i < kBeamsOfLamp; ++i) {
      const Vec2f u = sobol_owen(i, mix64(seed ^ (k << 32U)));
      farthest = std::max(farthest, trace_beam(k, to_float(normalized(beam_direction(*lamps_[k].light, {u.x, u.y})))));
    }
    // Beyond its own beams' ends a lamp lights nothing: a bulb in a lantern reaches the lantern.
    lamps_[k].reach = std::min(lamps_[k].reach, kBeyond * farthest);
  }
  for (Beam& b : beams_) b.density /= static_cast<float>(beams_.size());
}

/// Keeps the beam if it lights something. Returns its length then, else 0.
float BrightSpots::trace_beam(std::size_t lamp, const Vec3f& w) {
  const Scene& scene = tracer_.scene();
  const auto& [light, reach] = lamps_[lamp];
  const Hit hit = tracer_.closest(light->position, w, reach);
  if (!hit) return 0;
  const SurfacePoint p = surface_point(scene, hit.triangle, hit.u, hit.v);
  const auto material = static_cast<std::size_t>(scene.parts[scene.mesh.part[hit.triangle]].material);
  if (hit.back && !scene.materials[material].double_sided) return 0;
  const float side = hit.back ? -1 : 1;
  const LightArrival arrival = light_arrival(*light, to_double(p.position));
  const double cosine = dot(arrival.direction, to_double(p.normal)) * side;
  if (cosine <= 0 || arrival.distance == 0) return 0;
  const Vec3f face = p.geometric_normal * side;
  const Vec3f value = to_float(arrival.irradiance * (cosine * std::numbers::inv_pi));
  beams_.push_back(
      {offset_origin(p.position, face), face, albedo_at(scene, p) * value, density(lamp, p.position, face)});
  return hit.t;
}

/// Neighbours in space are neighbours in the list, so that looks at equal parts of it are spread over space.
void BrightSpots::sort_beams() {
  std::vector<Vec3f> ends;
  for (const Beam& b : beams_) ends.push_back(b.end);
  std::vector<Beam> sorted;
  for (const std::uint32_t i : morton_order(ends)) sorted.push_back(beams_[i]);
  beams_ = std::move(sorted);
}

float BrightSpots::density(std::size_t lamp, const Vec3f& place, const Vec3f& face) const {
  const auto& [light, reach] = lamps_[lamp];
  const Vec3f way = light->position - place;
  const float distance2 = dot(way, way), distance = std::sqrt(distance2);
  if (!(distance < reach) || distance2 == 0) return 0;
  return static_cast<float>(beam_density(*light, to_double(way / -distance))) * kBeamsOfLamp *
         std::abs(dot(way, face)) / (distance * distance2);
}

float BrightSpots::share_of_looks(std::size_t lamp, const Vec3f& place, const Vec3f& face, const Gathering& by) const {
  const float own = static_cast<float>(looks(by.rays)) * density(lamp, place, face) / static_cast<float>(beams_.size());
  return own > 0 ? own / (own + by.density) : 0;
}

Vec3f BrightSpots::gathered(const Lamps& lamps, const Receiver& at, const Gathering& by) const {
  Vec3f sum = lamps.punctual(at);
  for (std::size_t k = 0; k < lamps_.size(); ++k) {
    const float share = share_of_looks(k, at.origin, at.normal, by);
    if (share > 0) sum += lamps.punctual(at, *lamps_[k].light) * -share;
  }
  return sum;
}

Vec3f BrightSpots::look(const Receiver& from, int gathering_rays, Random& random) const {
  const int all = looks(gathering_rays);
  Rays16 rays;
  rays.ox.fill(from.origin.x), rays.oy.fill(from.origin.y), rays.oz.fill(from.origin.z);
  Vec3f sum;
  for (int first = 0; first < all; first += kPacket) {
    std::array<Vec3f, kPacket> light{};
    for (std::size_t i = 0; i < kPacket; ++i) {
      const float at = (static_cast<float>(first) + static_cast<float>(i) + random.uniform()) / static_cast<float>(all);
      const auto place = static_cast<std::size_t>(at * static_cast<float>(beams_.size()));
      const Beam& b = beams_[std::min(place, beams_.size() - 1)];
      const Vec3f way = b.end - from.origin;
      const float distance2 = dot(way, way), distance = std::sqrt(distance2);
      const Vec3f w = distance > 0 ? way / distance : b.face;
      rays.dx[i] = w.x, rays.dy[i] = w.y, rays.dz[i] = w.z, rays.far[i] = distance * kShortfall;
      const float cosine = dot(w, from.normal), facing = -dot(w, b.face);
      if (cosine <= 0 || facing <= 0 || distance == 0) continue;
      const float density = cosine * kInversePi * facing / distance2;
      light[i] =
          b.light * (density / (static_cast<float>(gathering_rays) * density + static_cast<float>(all) * b.density));
    }
    const std::uint32_t hidden = tracer_.occluded16(rays);
    for (std::size_t i = 0; i < kPacket; ++i) {
      if ((hidden >> i & 1U) == 0) sum += light[i];
    }
  }
  return sum;
}

}  // namespace kiln
