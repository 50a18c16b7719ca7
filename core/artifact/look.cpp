#include "core/artifact/look.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/artifact/evaluate.h"
#include "core/mesh/topology.h"
#include "core/scene/bright_part.h"

namespace kiln {
namespace {

constexpr float kKnee = 0.6F;
constexpr float kTarget = 0.8F;
constexpr double kPercentile = 0.9;

float brightest(const Vec3f& c) { return std::max({c.x, c.y, c.z}); }

using WeightedValues = std::vector<std::pair<float, double>>;  // value, area; ascending once sorted

WeightedValues corner_values(const Mesh& mesh, std::span<const Vec3f> radiance) {
  WeightedValues out;
  out.reserve(mesh.triangles.size() * 3);
  for (const Triangle& t : mesh.triangles) {
    const double area = triangle_area(mesh, t);
    for (const auto v : t) out.emplace_back(brightest(radiance[v]), area);
  }
  return out;
}

/// The smallest value that at least kPercentile of the area does not pass, among values above zero.
float lit_percentile(WeightedValues values) {
  std::erase_if(values, [](const auto& v) { return !(v.first > 0) || !std::isfinite(v.first); });
  std::ranges::sort(values);
  double total = 0;
  for (const auto& [value, area] : values) total += area;
  double below = 0;
  for (const auto& [value, area] : values) {
    below += area;
    if (below >= kPercentile * total) return value;
  }
  return 0;
}

}  // namespace

float tone_map(float x) {
  if (!(x > 0)) return 0;
  return x <= kKnee ? x : 1 - (1 - kKnee) * std::exp(-(x - kKnee) / (1 - kKnee));
}

Vec3f tone_map(const Vec3f& exposed) { return {tone_map(exposed.x), tone_map(exposed.y), tone_map(exposed.z)}; }

float exposure_for(float radiance) {
  const float displayed = kKnee - (1 - kKnee) * std::log((1 - kTarget) / (1 - kKnee));  // equation 1 solved for 0.8
  const float exposure = displayed / radiance;
  return std::isnormal(exposure) ? exposure : 1.0F;
}

float automatic_exposure(const Mesh& mesh, std::span<const Vec3f> radiance) {
  return exposure_for(lit_percentile(corner_values(mesh, radiance)));
}

std::vector<std::uint32_t> part_of_vertices(const Mesh& mesh) {
  std::vector<std::uint32_t> out(mesh.position.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto v : mesh.triangles[t]) out[v] = mesh.part[t];
  }
  return out;
}

PartLook part_look(const Scene& scene, const Part& part) {
  const Material& material = scene.materials[static_cast<std::size_t>(part.material)];
  return {{material.base_color.x, material.base_color.y, material.base_color.z},
          material.emission_texture.texture < 0 ? material.emission : Vec3f{}};
}

std::vector<Vec3f> baked_colors(const BakedScene& baked) {
  const Mesh& mesh = baked.scene.mesh;
  std::vector<Vec3f> out = shown_values(baked.transfer, baked.light.parts());
  const auto part_of = part_of_vertices(mesh);
  for (std::size_t v = 0; v < out.size(); ++v) {
    const Part& part = baked.scene.parts[part_of[v]];
    const PartLook look = part_look(baked.scene, part);
    const Vec3f tint = part.has_color ? Vec3f{mesh.color[v].x, mesh.color[v].y, mesh.color[v].z} : Vec3f{1, 1, 1};
    out[v] = look.albedo * tint * out[v] + look.emission;
  }
  return out;
}

BakedLight baked_light(const Environment& sky, int order) {
  BakedLight out{.name = sky.name, .coefficients = project_environment(sky, order)};
  const Environment bright = bright_part(sky);
  if (bright.width > 1 || bright.height > 1 || bright.radiance[0] != Vec3f{})
    out.bright = project_environment(bright, order);
  return out;
}

std::vector<Vec3f> displayed_colors(const BakedScene& baked) {
  std::vector<Vec3f> out = baked_colors(baked);
  for (Vec3f& c : out) c = tone_map(c * baked.exposure);
  return out;
}

}  // namespace kiln
