#include "core/trace/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/expects.h"
#include "core/mesh/topology.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

double range_window(double distance, double range) {
  if (range <= 0) return 1;
  const double ratio = distance / range;
  return std::clamp(1 - ratio * ratio * ratio * ratio, 0.0, 1.0);
}

double cone(const Light& light, const Vec3d& from_light) {
  const double outer = std::cos(double{light.outer_cone}), inner = std::cos(double{light.inner_cone});
  const double cosine = dot(from_light, to_double(light.direction));
  if (cosine <= outer) return 0;
  const double ramp = std::min(1.0, (cosine - outer) / std::max(inner - outer, 1e-9));
  return ramp * ramp;
}

const Material& material_of(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)];
}

double strength(const Material& material) {
  const Vec3f& e = material.emission;
  return double{e.x} + double{e.y} + double{e.z};
}

}  // namespace

LightArrival light_arrival(const Light& light, const Vec3d& point) {
  const Vec3d intensity = to_double(light.intensity);
  if (light.type == LightType::directional)
    return {-to_double(light.direction), std::numeric_limits<double>::infinity(), intensity};
  const Vec3d way = to_double(light.position) - point;
  const double distance = length(way);
  if (distance == 0) return {{0, 1, 0}, 0, {}};
  const Vec3d direction = way / distance;
  const double spread = light.type == LightType::spot ? cone(light, -direction) : 1;
  return {direction, distance, intensity * (spread * range_window(distance, light.range) / (distance * distance))};
}

Vec3d beam_direction(const Light& light, const Vec2<double>& u) {
  if (light.type != LightType::spot) return uniform_sphere(u);
  const double z = 1 - u.x * (1 - std::cos(double{light.outer_cone})), r = std::sqrt(std::max(0.0, 1 - z * z)),
               phi = 2 * std::numbers::pi * u.y;
  return basis_around(normalized(to_double(light.direction))).to_world({r * std::cos(phi), r * std::sin(phi), z});
}

double beam_density(const Light& light, const Vec3d& from_light) {
  constexpr double kNarrowest = 1e-6;
  if (light.type != LightType::spot) return 0.25 / std::numbers::pi;
  const double outer = std::cos(double{light.outer_cone});
  return dot(from_light, to_double(light.direction)) < outer - kNarrowest
             ? 0
             : 0.5 / std::numbers::pi / std::max(1 - outer, kNarrowest);
}

EmitterSampler::EmitterSampler(const Scene& scene) : scene_(scene) {
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const double power = strength(material_of(scene, t)) * triangle_area(scene.mesh, scene.mesh.triangles[t]);
    if (power <= 0) continue;
    total_ += power;
    triangles_.push_back(t);
    cumulative_.push_back(total_);
  }
}

EmitterSample EmitterSampler::sample(double pick, const Vec2<double>& u) const {
  EXPECTS(!empty());
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, pick * total_);
  const std::uint32_t triangle = triangles_[static_cast<std::size_t>(found - cumulative_.begin())];
  const Vec2<double> b = uniform_triangle(u);
  const SurfacePoint p = surface_point(scene_, triangle, static_cast<float>(b.x), static_cast<float>(b.y));
  return {.position = to_double(p.position),
          .normal = to_double(p.geometric_normal),
          .radiance = opacity_at(scene_, p) < kOpaqueFrom ? Vec3d{} : to_double(emission_at(scene_, p)),
          .double_sided = material_of(scene_, triangle).double_sided,
          .density = density(triangle)};
}

double EmitterSampler::density(std::uint32_t triangle) const {
  return total_ > 0 ? strength(material_of(scene_, triangle)) / total_ : 0;
}

}  // namespace kiln
