#include "core/trace/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/base/expects.h"
#include "core/mesh/topology.h"
#include "core/sphere/sampling.h"
#include "core/trace/brightness_table.h"
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

/// Red, green and blue of the emission, about its mean over a triangle: 0 only where nothing of it emits.
class Strength {
 public:
  explicit Strength(const Scene& scene) : scene_(scene), tables_(scene.images.size()) {}

  double of(std::uint32_t triangle) {
    const Material& material = material_of(scene_, triangle);
    const double factor = strength(material);
    const TextureRef& ref = material.emission_texture;
    const int image =
        factor > 0 && ref.texture >= 0 ? scene_.textures[static_cast<std::size_t>(ref.texture)].image : -1;
    if (image < 0 || scene_.images[static_cast<std::size_t>(image)].rgba.empty()) return factor;
    std::optional<BrightnessTable>& table = tables_[static_cast<std::size_t>(image)];
    if (!table) table.emplace(scene_.images[static_cast<std::size_t>(image)]);
    return factor * brightness(triangle, ref, *table);
  }

 private:
  double brightness(std::uint32_t triangle, const TextureRef& ref, const BrightnessTable& table) const {
    const std::vector<Vec2f>& uv = ref.uv_set == 1 ? scene_.mesh.uv1 : scene_.mesh.uv0;
    const auto& m = ref.transform;
    std::array<Vec2d, 3> corners;
    double largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2f at = uv.empty() ? Vec2f{} : uv[scene_.mesh.triangles[triangle][k]];
      corners[k] = {double{m[0]} * at.x + double{m[1]} * at.y + m[2], double{m[3]} * at.x + double{m[4]} * at.y + m[5]};
      largest = std::max({largest, std::abs(double{m[0]} * at.x) + std::abs(double{m[1]} * at.y),
                          std::abs(double{m[3]} * at.x) + std::abs(double{m[4]} * at.y)});
    }
    constexpr double kRounding = 8 * 0x1p-24;  // of coordinates that are interpolated in float, relative
    return table.mean(corners, kRounding * largest, scene_.textures[static_cast<std::size_t>(ref.texture)]);
  }

  const Scene& scene_;
  std::vector<std::optional<BrightnessTable>> tables_;  // of each image, where an emitter asks for it
};

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
  if (std::ranges::none_of(scene.materials, [](const Material& m) { return strength(m) > 0; })) return;
  Strength strengths(scene);
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    strength_.push_back(static_cast<float>(strengths.of(t)));
    const double power = double{strength_.back()} * triangle_area(scene.mesh, scene.mesh.triangles[t]);
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
  const auto& [i, j, k] = scene_.mesh.triangles[triangle];
  const Vec3d corner = to_double(scene_.mesh.position[i]), one = to_double(scene_.mesh.position[j]) - corner,
              other = to_double(scene_.mesh.position[k]) - corner;
  const SurfacePoint p{.triangle = triangle, .u = static_cast<float>(b.x), .v = static_cast<float>(b.y)};
  return {.position = corner + one * b.x + other * b.y,
          .normal = normalized(cross(one, other)),
          .radiance = opacity_at(scene_, p) < kOpaqueFrom ? Vec3d{} : to_double(emission_at(scene_, p)),
          .double_sided = material_of(scene_, triangle).double_sided,
          .density = density(triangle)};
}

double EmitterSampler::density(std::uint32_t triangle) const {
  return total_ > 0 ? double{strength_[triangle]} / total_ : 0;
}

}  // namespace kiln
