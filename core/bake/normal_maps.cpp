#include "core/bake/normal_maps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/image_decode.h"
#include "core/scene/texture.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::size_t kPoints = 4096;

/// The textures of a scene, and the pixels of those images that `needed` names.
Scene textures_of(const Scene& scene, const std::vector<std::size_t>& materials) {
  Scene out;
  out.textures = scene.textures;
  out.images.resize(scene.images.size());
  for (const std::size_t m : materials) {
    const int texture = scene.materials[m].normal_texture.texture;
    const int number = scene.textures[static_cast<std::size_t>(texture)].image;
    if (number < 0) continue;
    const Image& from = scene.images[static_cast<std::size_t>(number)];
    Image& to = out.images[static_cast<std::size_t>(number)];
    if (!to.rgba.empty()) continue;
    to.width = from.width, to.height = from.height, to.rgba = from.rgba;
    if (!to.rgba.empty()) continue;
    const auto header = read_image_header(from.encoded);
    auto pixels = header ? decode_image(from.encoded, *header) : std::nullopt;
    if (!pixels) continue;
    to.width = static_cast<int>(header->width), to.height = static_cast<int>(header->height);
    to.rgba = std::move(*pixels);
  }
  return out;
}

bool has_pixels(const Scene& maps, const TextureRef& map) {
  const int image = maps.textures[static_cast<std::size_t>(map.texture)].image;
  return image >= 0 && !maps.images[static_cast<std::size_t>(image)].rgba.empty();
}

/// Of equation 1.
double angle_at(const Scene& maps, const TextureRef& map, const Vec2f& uv) {
  const Vec4f texel = sample_texture(maps, map, uv, false);
  const double side = double{map.scale} * std::hypot(2 * double{texel.x} - 1, 2 * double{texel.y} - 1);
  return std::atan2(side, 2 * double{texel.z} - 1);
}

}  // namespace

std::optional<NormalMaps> find_normal_maps(const Scene& scene) {
  std::vector<bool> used(scene.materials.size());
  for (const std::uint32_t part : scene.mesh.part) used[static_cast<std::size_t>(scene.parts[part].material)] = true;
  NormalMaps out;
  for (std::size_t m = 0; m < used.size(); ++m)
    if (used[m] && scene.materials[m].normal_texture.texture >= 0) out.materials.push_back(m);
  if (out.materials.empty()) return std::nullopt;
  const Scene maps = textures_of(scene, out.materials);
  double squares = 0, all = 0;
  for (const SurfaceSample& s : sample_surface(scene.mesh, kPoints, 0)) {
    const Part& part = scene.parts[scene.mesh.part[s.triangle]];
    const TextureRef& map = scene.materials[static_cast<std::size_t>(part.material)].normal_texture;
    const std::vector<Vec2f>& uv = map.uv_set == 1 ? scene.mesh.uv1 : scene.mesh.uv0;
    if (map.texture < 0 || uv.empty() || !has_pixels(maps, map)) continue;
    const Triangle& t = scene.mesh.triangles[s.triangle];
    const float w = 1 - s.u - s.v;
    const double angle = angle_at(
        maps, map,
        {uv[t[0]].x * w + uv[t[1]].x * s.u + uv[t[2]].x * s.v, uv[t[0]].y * w + uv[t[1]].y * s.u + uv[t[2]].y * s.v});
    squares += angle * angle, all += 1;
  }
  if (all > 0) out.degrees = std::sqrt(squares / all) * 180 / std::numbers::pi;
  return out;
}

}  // namespace kiln
