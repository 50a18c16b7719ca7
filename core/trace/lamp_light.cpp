#include "core/trace/lamp_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/sphere/sampling.h"

namespace kiln {
namespace {

Vec3d times(const Vec3d& a, const Vec3f& b) { return a * to_double(b); }

/// The side of its face that a vertex's rays leave from.
Vec3d side_of(const PathVertex& v) { return dot(v.normal, v.face) < 0 ? -v.face : v.face; }

/// Per area at a place, of cosine-distributed rays from a vertex that sees it; 0 where the two are one.
double density_at(const PathVertex& from, const Vec3d& place, const Vec3d& face) {
  const Vec3d way = place - from.position;
  const double distance2 = dot(way, way);
  if (!(distance2 > 0)) return 0;
  const Vec3d w = normalized(way);
  return std::max(0.0, dot(w, from.normal)) * std::abs(dot(w, face)) / (std::numbers::pi * distance2);
}

/// Beams that leave an emitter and end at a vertex, against one ray of the path there: per solid angle around w at the
/// vertex, as `density` of the emitter's point is per area.
double beams_against_path(double share, double density, bool both_sides, const Vec3d& w, const PathVertex& v) {
  const double beams = share * density * std::abs(dot(w, v.face)) / (std::numbers::pi * (both_sides ? 2 : 1));
  return beams > 0 ? beams / v.against_beams : 0;
}

/// The point of a surface as it is seen from a place; nothing from behind a single-sided face, or along it.
std::optional<PathVertex> seen_from(const Scene& scene, const SurfacePoint& p, const Vec3d& place) {
  const double facing = dot(place - to_double(p.position), to_double(p.geometric_normal));
  const auto material = static_cast<std::size_t>(scene.parts[scene.mesh.part[p.triangle]].material);
  if (facing == 0 || (facing < 0 && !scene.materials[material].double_sided)) return std::nullopt;
  const double side = facing < 0 ? -1 : 1;
  return PathVertex{to_double(p.position), to_double(p.normal) * side, to_double(p.geometric_normal) * side};
}

double power(const Light& light) {
  const double sum = double{light.intensity.x} + light.intensity.y + light.intensity.z;
  return light.type == LightType::directional ? 0
                                              : std::max(0.0, sum) / beam_density(light, to_double(light.direction));
}

}  // namespace

PathVertex vertex_after(const PathVertex& from, const Vec3d& position, const Vec3d& normal, const Vec3d& face) {
  PathVertex out{position, normal, face, density_at(from, position, face)};
  const double back = density_at(out, from.position, from.face);
  out.against_beams = back > 0 ? out.density / (1 + back / from.density) : out.density;
  return out;
}

Vec3f lifted(const PathVertex& v) { return offset_origin(to_float(v.position), to_float(side_of(v))); }

LampLight::LampLight(const Tracer& tracer, std::span<const Light> lamps, bool scene_lights)
    : tracer_(tracer), scene_(tracer.scene()), own_(lamps), scene_lights_(scene_lights), emitters_(tracer.emitters()) {
  choose_senders();
}

/// Beams go to all lightings alike, and within the scene's to each lamp by its power.
void LampLight::choose_senders() {
  for (std::size_t k = 0; k < own_.size(); ++k) senders_.push_back({&own_[k], k, power(own_[k]) > 0 ? 1.0 : 0.0});
  if (scene_lights_) {
    double all = std::numbers::pi * emitters_.total_strength();
    for (const Light& light : scene_.lights) all += power(light);
    const double unit = all > 0 ? 1 / all : 0;
    for (const Light& light : scene_.lights) senders_.push_back({&light, own_.size(), unit * power(light)});
    senders_.push_back({nullptr, own_.size(), unit * std::numbers::pi * emitters_.total_strength()});
  }
  double sum = 0;
  for (const Sender& s : senders_) sum += s.share;
  has_beams_ = sum > 0;
  for (Sender& s : senders_) s.share = sum > 0 ? s.share / sum : 0;
}

const LampLight::Sender& LampLight::pick(double u) const {
  const Sender* last = nullptr;
  for (const Sender& s : senders_) {
    if (s.share == 0) continue;
    last = &s;
    if (u < s.share) break;
    u -= s.share;
  }
  return *last;
}

std::uint64_t LampLight::rays_per_vertex() const {
  const std::uint64_t emitters = scene_lights_ ? 1 : 0;  // the last sender
  return senders_.size() - emitters + (has_emitters() ? 1 : 0) + (has_beams() ? 4 : 0);
}

/// Of beams at a vertex, per area.
double LampLight::density_of_beams(const Sender& from, const LightArrival& arrival, const PathVertex& v) {
  return from.share * beam_density(*from.light, -arrival.direction) * std::abs(dot(arrival.direction, v.face)) /
         (arrival.distance * arrival.distance);
}

/// Unshadowed, in this way's part.
Vec3d LampLight::sent(const Sender& from, const PathVertex& v) {
  const LightArrival arrival = light_arrival(*from.light, v.position);
  const double cosine = dot(arrival.direction, v.normal);
  if (cosine <= 0 || arrival.irradiance == Vec3d{}) return {};
  const double beams = std::isfinite(v.density) && from.share > 0 ? density_of_beams(from, arrival, v) : 0;
  const double balance = beams > 0 ? v.against_beams / (v.against_beams + beams) : 1;
  return arrival.irradiance * (cosine / std::numbers::pi * balance);
}

/// Unshadowed, in this way's part; of one point of the emitters.
Vec3d LampLight::emitted(const EmitterSample& from, const PathVertex& v) const {
  const Vec3d way = from.position - v.position;
  const double distance2 = dot(way, way);
  const Vec3d w = normalized(way);
  const double facing = -dot(w, from.normal), own = dot(w, v.normal) / std::numbers::pi;
  if (distance2 == 0 || own <= 0 || (from.double_sided ? facing == 0 : facing <= 0)) return {};
  const double shadow_ray = from.density * distance2 / std::abs(facing);  // per solid angle, as all three
  const double beam = beams_against_path(senders_.back().share, from.density, from.double_sided, w, v);
  return from.radiance * (own / (own + shadow_ray + beam));
}

bool LampLight::in_shadow(const PathVertex& v, const Vec3d& lamp, const Vec3d& lamp_face) const {
  const Vec3f from = lifted(v);
  const Vec3d facing = dot(v.position - lamp, lamp_face) < 0 ? -lamp_face : lamp_face;
  const Vec3d end = lamp_face == Vec3d{} ? lamp : to_double(offset_origin(to_float(lamp), to_float(facing)));
  const Vec3d clear = end - to_double(from);
  return tracer_.occluded(from, to_float(normalized(clear)), static_cast<float>(length(clear)));
}

Vec3d LampLight::punctual(const Sender& from, const PathVertex& v) const {
  const Light& light = *from.light;
  const Vec3d value = sent(from, v);
  if (value == Vec3d{}) return {};
  if (light.type == LightType::directional) {
    const bool shadow = tracer_.occluded(lifted(v), -light.direction, std::numeric_limits<float>::infinity());
    return shadow ? Vec3d{} : value;
  }
  return in_shadow(v, to_double(light.position), {}) ? Vec3d{} : value;
}

void LampLight::add_direct(const PathVertex& v, const Vec3d& weight, const Draw& draw, std::span<Vec3d> sum) const {
  for (const Sender& s : senders_) {
    if (s.light != nullptr) sum[s.lighting] += weight * punctual(s, v);
  }
  if (!has_emitters()) return;
  const EmitterSample from = emitters_.sample(draw.emitter, draw.place);
  const Vec3d value = emitted(from, v);
  if (value != Vec3d{} && !in_shadow(v, from.position, from.normal)) sum[own_.size()] += weight * value;
}

void LampLight::add_met(const PathVertex& v, const Vec3d& w, double density, const Hit& hit, const SurfacePoint& p,
                        const Vec3d& weight, std::span<Vec3d> sum) const {
  const double strength = scene_lights_ ? emitters_.density(hit.triangle) : 0;
  if (!(strength > 0)) return;
  const bool both =
      scene_.materials[static_cast<std::size_t>(scene_.parts[scene_.mesh.part[hit.triangle]].material)].double_sided;
  const double facing = std::max(1e-12, std::abs(dot(w, to_double(p.geometric_normal))));
  const double shadow_ray = strength * double{hit.t} * double{hit.t} / facing;
  const double beam = beams_against_path(senders_.back().share, strength, both, w, v);
  sum[own_.size()] += times(weight, emission_at(scene_, p)) * (density / (density + shadow_ray + beam));
}

LampLight::Beam LampLight::draw_beam(const Sender& sender, const Draw& draw) const {
  if (sender.light != nullptr)
    return {to_double(sender.light->position), beam_direction(*sender.light, draw.direction), {}};
  const EmitterSample from = emitters_.sample(draw.emitter, draw.place);
  const bool behind = from.double_sided && draw.direction.x < 0.5;
  const Vec2<double> u{from.double_sided ? std::fmod(2 * draw.direction.x, 1.0) : draw.direction.x, draw.direction.y};
  const Vec3d side = behind ? -from.normal : from.normal;
  return {to_double(offset_origin(to_float(from.position), to_float(side))),
          basis_around(side).to_world(cosine_hemisphere(u)), from};
}

/// Irradiance / pi that a beam brings to where it ended, in this way's part.
Vec3d LampLight::carried(const Sender& sender, const Beam& beam, const PathVertex& lit) const {
  if (dot(beam.direction, side_of(lit)) >= 0) return {};  // from behind
  return sender.light != nullptr ? sent(sender, lit) : emitted(beam.emitter, lit);
}

void LampLight::add_beam(const PathVertex& v, const Vec3d& weight, const Draw& draw, bool once, bool twice,
                         std::span<Vec3d> sum) const {
  const Sender& sender = pick(draw.pick);
  const Beam beam = draw_beam(sender, draw);
  const auto surface_along = [&](const Vec3f& from, const Vec3d& w) -> std::optional<SurfacePoint> {
    const Hit hit = tracer_.closest(from, to_float(normalized(w)), std::numeric_limits<float>::infinity());
    if (!hit) return std::nullopt;
    return surface_point(scene_, hit.triangle, hit.u, hit.v);
  };
  const auto end = surface_along(to_float(beam.from), beam.direction);
  if (!end) return;
  const auto looked_at = [&](const SurfacePoint& p) -> std::optional<PathVertex> {
    const auto seen = seen_from(scene_, p, v.position);
    if (!seen || !(dot(seen->position - v.position, v.normal) > 0)) return std::nullopt;
    return vertex_after(v, seen->position, seen->normal, seen->face);
  };
  if (const auto lit = once ? looked_at(*end) : std::nullopt) {
    const Vec3d value = carried(sender, beam, *lit);
    if (value != Vec3d{} && !in_shadow(v, lit->position, side_of(*lit)))
      sum[sender.lighting] += times(weight, albedo_at(scene_, *end)) * value;
  }

  const auto mirror = twice ? seen_from(scene_, *end, beam.from) : std::nullopt;
  if (!mirror) return;
  const auto second =
      surface_along(lifted(*mirror), basis_around(mirror->normal).to_world(cosine_hemisphere(draw.reflection)));
  if (!second) return;
  const auto lit = looked_at(*second);
  if (!lit || dot(mirror->position - lit->position, side_of(*lit)) <= 0) return;
  const PathVertex before = vertex_after(*lit, mirror->position, mirror->normal, mirror->face);
  if (!(before.density > 0)) return;
  const Vec3d value = carried(sender, beam, before);
  if (value != Vec3d{} && !in_shadow(v, lit->position, side_of(*lit)))
    sum[sender.lighting] += times(times(weight, albedo_at(scene_, *end)), albedo_at(scene_, *second)) * value;
}

}  // namespace kiln
