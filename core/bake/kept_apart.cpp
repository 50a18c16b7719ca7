#include "core/bake/kept_apart.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/bake/plan.h"
#include "core/lightfield/outgoing.h"
#include "core/sphere/sh.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

/// Of the faces' middles.
double least_roughness(const Scene& scene) {
  double least = 1;
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    constexpr float kThird = 1.0F / 3;
    least = std::min(least, double{finish_at(scene, surface_point(scene, t, kThird, kThird)).roughness});
  }
  return least;
}

}  // namespace

double left_by_bands(const Environment& sky, int degree) {
  constexpr int kHeight = 64;
  const Environment map = averaged_sky(kHeight, 4, [&](const Vec3f& w) { return environment_radiance(sky, w); });
  const std::vector<Vec3f> c = project_environment(map, degree + 1);
  double squares = 0, mean = 0, held = 0;
  for (int y = 0; y < map.height; ++y) {
    const double area = std::cos(std::numbers::pi * y / kHeight) - std::cos(std::numbers::pi * (y + 1) / kHeight);
    for (int x = 0; x < map.width; ++x) {
      const Vec3d l = to_double(map.radiance[static_cast<std::size_t>(y * map.width + x)]);
      squares += area * dot(l, l);
      mean += area * (l.x + l.y + l.z);
    }
  }
  const double all = 2.0 * map.width;  // sum of the areas
  for (const Vec3f& ci : c) held += double{dot(ci, ci)} / (4 * std::numbers::pi);
  const double level = mean / (3 * all), left = std::max(0.0, squares / all - held) / 3;
  return level > 0 ? std::sqrt(left) / level : 0;
}

ApartDecision decide_sky(const Scene& scene, const Environment* sky, int degree, double share, SkyPart asked) {
  const std::string because = asked == SkyPart::automatic ? "" : "asked for by the recipe";
  if (sky == nullptr) return {false, "there is none"};
  if (degree + 1 < kVisibilityOrder) return {false, "the series has fewer bands than what is seen of the sky"};
  if (asked == SkyPart::series) return {false, because};
  const double smooth = least_roughness(scene);
  const std::string roughness = "roughness " + short_text(smooth);
  if (!(share_apart(smooth) > 0)) return {false, "the smoothest surface has " + roughness + ": the series holds it"};
  if (asked == SkyPart::apart) return {true, because};
  const double left = left_by_bands(*sky, degree);
  const std::string bands = std::to_string(degree + 1) + " bands leave " + short_text(100 * left) + " % of the sky out";
  if (left <= share) return {false, bands};
  return {true, "surfaces of " + roughness + " mirror it, and " + bands};
}

ApartDecision decide_lamps(const Scene& scene) {
  if (scene.lights.empty()) return {false, "there are none"};
  const double smooth = least_roughness(scene);
  const std::string roughness = "roughness " + short_text(smooth);
  if (!(share_apart(smooth) > 0)) return {false, "the smoothest surface has " + roughness + ": the series holds them"};
  const std::size_t all = scene.lights.size();
  const std::string which =
      all > kMostFieldLamps ? "the " + std::to_string(kMostFieldLamps) + " brightest of " + std::to_string(all) + ": "
                            : "";
  return {true, which + "surfaces of " + roughness + " mirror them as points"};
}

ApartDecision decide_emission(const Scene& scene) {
  const bool textured = std::ranges::any_of(scene.parts, [&](const Part& part) {
    const Material& material = scene.materials[static_cast<std::size_t>(part.material)];
    return dot(material.emission, material.emission) > 0 && material.emission_texture.texture >= 0;
  });
  return {textured, textured ? "textures glow, more sharply than vertices can say" : "no texture glows"};
}

ApartDecision decide_diffuse(const Scene& scene) {
  const bool textured = std::ranges::any_of(scene.parts, [&](const Part& part) {
    const Material& m = scene.materials[static_cast<std::size_t>(part.material)];
    const bool shaped = m.metallic_roughness_texture.texture >= 0 && m.metallic > 0;
    return shaped || (m.base_color_texture.texture >= 0 && m.metallic < 1);
  });
  return {textured, textured ? "textures colour it, more sharply than vertices can say" : "no texture colours it"};
}

std::optional<std::string> softened_emitters(const Scene& scene, int degree) {
  const bool glows = std::ranges::any_of(scene.parts, [&](const Part& part) {
    const Vec3f& emission = scene.materials[static_cast<std::size_t>(part.material)].emission;
    return dot(emission, emission) > 0;
  });
  if (!glows) return std::nullopt;
  const double smooth = least_roughness(scene);
  if (!(share_apart(smooth) > 0)) return std::nullopt;
  return "surfaces of roughness " + short_text(smooth) + " show what glows by " + std::to_string(degree + 1) +
         " bands only: soft, with rings around it; more bands (degree, at most 8) or punctual lamps in its place are "
         "sharper";
}

}  // namespace kiln
