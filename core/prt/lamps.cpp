#include "core/prt/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sobol_points.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr double kInversePi = std::numbers::inv_pi;
constexpr double kShortfall = 1 - 4e-6;  // a shadow ray ends this fraction before its lamp, which would stop it

bool is_double_sided(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)].double_sided;
}

constexpr double kLeft = 0.7;  // as of transfer vectors: halves of a stratified set differ by their own errors

void set_lane(Rays16& rays, std::size_t i, const Vec3d& direction, double far) {
  const Vec3f w = to_float(direction);
  rays.dx[i] = w.x, rays.dy[i] = w.y, rays.dz[i] = w.z;
  rays.far[i] = static_cast<float>(far);
}

void set_origin(Rays16& rays, const Vec3f& origin) {
  rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z);
}

}  // namespace

Vec3f Lamps::punctual(const Receiver& at) const {
  Vec3f sum;
  for (const Light& light : tracer_.scene().lights) sum += punctual(at, light);
  return sum;
}

Vec3f Lamps::punctual(const Receiver& at, const Light& light) const {
  const LightArrival arrival = light_arrival(light, to_double(at.origin));
  const double cosine = dot(arrival.direction, to_double(at.normal));
  if (cosine <= 0 || arrival.irradiance == Vec3d{}) return {};
  const double far = std::min(arrival.distance * kShortfall, double{kFar});
  if (tracer_.occluded(at.origin, to_float(arrival.direction), static_cast<float>(far))) return {};
  return to_float(arrival.irradiance * (cosine * kInversePi));
}

Vec3f Lamps::emitted(const Receiver& at, const EmitterRays& wanted, std::uint64_t seed, std::uint64_t& rays) const {
  if (emitters_.empty()) return {};
  EXPECTS(wanted.reach == 1 || wanted.samples % 16 == 0);
  const int most = wanted.samples * wanted.reach;
  const double cosine = static_cast<double>(cosine_share(wanted.samples)) / wanted.samples;
  const SobolPoints points(mix64(seed)), directions(mix64(seed + 1));
  Vec3d sum, mean;
  double change = 0;  // squared, of the mean; the last round's, or a half of the one before
  int done = 0;
  for (int end = wanted.reach > 1 ? wanted.samples / 4 : most; done < most; end = std::min(2 * end, most)) {
    sum += from_points(at, {done, end, cosine}, points, rays) +
           from_rays(at, {cosine_share(done), cosine_share(end), cosine}, directions);
    rays += static_cast<std::uint64_t>(cosine_share(end) - cosine_share(done));
    const Vec3d step = sum / end - std::exchange(mean, sum / end);
    change = done == 0 ? 0 : std::max(dot(step, step), change / 4);
    done = end;
    if (done >= wanted.samples && kLeft * change / 3 <= wanted.tolerance * wanted.tolerance) break;
  }
  return to_float(mean);
}

Vec3d Lamps::from_points(const Receiver& at, const Round& round, const SobolPoints& points, std::uint64_t& sent) const {
  const Vec3d origin = to_double(at.origin), normal = to_double(at.normal);
  Vec3d sum;
  Rays16 rays;
  set_origin(rays, at.origin);
  std::array<Vec3d, kPacket> light;
  std::size_t lanes = 0;  // samples that may bring light and wait for a full packet
  const auto send = [&] {
    const std::uint32_t hidden = tracer_.occluded16(rays, static_cast<int>(lanes));
    for (std::size_t i = 0; i < lanes; ++i) {
      if ((hidden >> i & 1U) == 0) sum += light[i];
    }
    sent += std::exchange(lanes, 0);
  };
  for (auto index = static_cast<std::uint32_t>(round.first); index < static_cast<std::uint32_t>(round.last); ++index) {
    const Vec3f u = points[index];
    const EmitterSample s = emitters_.sample(u.z, {u.x, u.y});
    const Vec3d way = s.position - origin;
    const double across = dot(way, normal), along = dot(way, s.normal),
                 facing = s.double_sided ? std::abs(along) : -along;
    if (across <= 0 || facing <= 0 || s.radiance == Vec3d{}) continue;
    const double distance2 = dot(way, way), distance = std::sqrt(distance2);
    const Vec3d w = way * (1 / distance);
    const double cosine = across * kInversePi / distance;
    const double solid_density = s.density * distance2 * distance / facing;
    light[lanes] = s.radiance * (cosine / (solid_density + round.cosine * cosine));
    set_lane(rays, lanes++, w, distance * kShortfall);
    if (lanes == kPacket) send();
  }
  if (lanes > 0) send();
  return sum;
}

Vec3d Lamps::from_rays(const Receiver& at, const Round& round, const SobolPoints& directions) const {
  const Basis<float> basis = basis_around(at.normal);
  Vec3d sum;
  for (int first = round.first; first < round.last; first += kPacket) {
    const int count = std::min(kPacket, round.last - first);
    Rays16 rays;
    set_origin(rays, at.origin);
    std::array<Vec3f, kPacket> local;
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      local[k] = cosine_hemisphere(directions.pair(static_cast<std::uint32_t>(first + i)));
      set_lane(rays, k, to_double(basis.to_world(local[k])), kFar);
    }
    Hits16 hits;
    tracer_.closest16(rays, hits, count);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (hits.triangle[i] == kNoHit) continue;
      const double density = emitters_.density(hits.triangle[i]);
      if (density <= 0) continue;
      const Vec3f w{rays.dx[i], rays.dy[i], rays.dz[i]};
      const SurfacePoint p = surface_point(tracer_.scene(), hits.triangle[i], hits.u[i], hits.v[i]);
      const double facing = std::abs(dot(w, p.geometric_normal));
      const double solid_density = density * hits.t[i] * hits.t[i] / std::max(facing, 1e-12);
      const double cosine = local[i].z * kInversePi;
      const double weight = cosine / (solid_density + round.cosine * cosine);
      sum += to_double(emission(p, w)) * weight;
    }
  }
  return sum;
}

Vec3f Lamps::emission(std::uint32_t triangle, float u, float v, const Vec3f& direction) const {
  if (emitters_.density(triangle) == 0) return {};
  return emission(surface_point(tracer_.scene(), triangle, u, v), direction);
}

Vec3f Lamps::emission(const SurfacePoint& p, const Vec3f& direction) const {
  const Scene& scene = tracer_.scene();
  if (dot(p.geometric_normal, direction) >= 0 && !is_double_sided(scene, p.triangle)) return {};
  return emission_at(scene, p);
}

}  // namespace kiln
