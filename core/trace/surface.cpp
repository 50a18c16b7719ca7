#include "core/trace/surface.h"

#include <algorithm>

namespace kiln {
namespace {

constexpr float kMaxAlbedo = 0.999F;  // a closed room of albedo 1 would never come to rest

template <class V>
auto corners(const std::vector<V>& values, const Triangle& t) {
  return std::array<V, 3>{values[t[0]], values[t[1]], values[t[2]]};
}

Vec3d blend(const std::vector<Vec3f>& values, const Triangle& t, double u, double v) {
  const auto [a, b, c] = corners(values, t);
  return to_double(a) * (1 - u - v) + to_double(b) * u + to_double(c) * v;
}

const Part& part_of(const Scene& scene, std::uint32_t triangle) { return scene.parts[scene.mesh.part[triangle]]; }

const Material& material_of(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(part_of(scene, triangle).material)];
}

Vec2f uv_at(const Scene& scene, const SurfacePoint& p, int set) {
  const std::vector<Vec2f>& uv = set == 1 ? scene.mesh.uv1 : scene.mesh.uv0;
  if (uv.empty()) return {};
  const auto [a, b, c] = corners(uv, scene.mesh.triangles[p.triangle]);
  const float w = 1 - p.u - p.v;
  return {a.x * w + b.x * p.u + c.x * p.v, a.y * w + b.y * p.u + c.y * p.v};
}

Vec4f vertex_color_at(const Scene& scene, const SurfacePoint& p) {
  if (scene.mesh.color.empty() || !part_of(scene, p.triangle).has_color) return {1, 1, 1, 1};
  const auto [a, b, c] = corners(scene.mesh.color, scene.mesh.triangles[p.triangle]);
  const float w = 1 - p.u - p.v;
  return {a.x * w + b.x * p.u + c.x * p.v, a.y * w + b.y * p.u + c.y * p.v, a.z * w + b.z * p.u + c.z * p.v,
          a.w * w + b.w * p.u + c.w * p.v};
}

Vec4f texture_at(const Scene& scene, const SurfacePoint& p, const TextureRef& ref, bool srgb = true) {
  return sample_texture(scene, ref, uv_at(scene, p, ref.uv_set), srgb);
}

}  // namespace

SurfacePoint surface_point(const Scene& scene, std::uint32_t triangle, float u, float v) {
  const Triangle& t = scene.mesh.triangles[triangle];
  const auto [a, b, c] = corners(scene.mesh.position, t);
  const Vec3d smooth = normalized(blend(scene.mesh.normal, t, u, v), normalized(to_double(scene.mesh.normal[t[0]])));
  // Double edges: needles whose area underflows in float keep their direction; a face without one takes the vertex's.
  const Vec3d face = normalized(cross(to_double(b) - to_double(a), to_double(c) - to_double(a)), smooth);
  // A shading normal under the face is mirrored over it, which is continuous where the two are at right angles.
  const double under = std::min(0.0, dot(smooth, face));
  return {.position = to_float(blend(scene.mesh.position, t, u, v)),
          .geometric_normal = to_float(face),
          .normal = to_float(normalized(smooth - face * (2 * under), face)),
          .triangle = triangle,
          .u = u,
          .v = v};
}

Vec3f albedo_at(const Scene& scene, const SurfacePoint& p) {
  const Material& material = material_of(scene, p.triangle);
  const Vec4f texel = texture_at(scene, p, material.base_color_texture);
  const Vec4f tint = vertex_color_at(scene, p);
  const auto limited = [](float x) { return std::clamp(x, 0.0F, kMaxAlbedo); };
  return {limited(material.base_color.x * texel.x * tint.x), limited(material.base_color.y * texel.y * tint.y),
          limited(material.base_color.z * texel.z * tint.z)};
}

SurfaceFinish finish_at(const Scene& scene, const SurfacePoint& p) {
  const Material& material = material_of(scene, p.triangle);
  const Vec4f texel = texture_at(scene, p, material.metallic_roughness_texture, false);
  return {std::clamp(material.metallic * texel.z, 0.0F, 1.0F), std::clamp(material.roughness * texel.y, 0.0F, 1.0F)};
}

Vec3f emission_at(const Scene& scene, const SurfacePoint& p) {
  const Material& material = material_of(scene, p.triangle);
  if (material.emission == Vec3f{}) return {};
  const Vec4f texel = texture_at(scene, p, material.emission_texture);
  return material.emission * Vec3f{texel.x, texel.y, texel.z};
}

float opacity_at(const Scene& scene, const SurfacePoint& p) {
  const Material& material = material_of(scene, p.triangle);
  if (material.alpha_mode == AlphaMode::opaque) return 1;
  const float alpha =
      material.base_color.w * texture_at(scene, p, material.base_color_texture).w * vertex_color_at(scene, p).w;
  if (material.alpha_mode == AlphaMode::mask) return alpha >= material.alpha_cutoff ? 1.0F : 0.0F;
  return std::clamp(alpha, 0.0F, 1.0F);
}

}  // namespace kiln
