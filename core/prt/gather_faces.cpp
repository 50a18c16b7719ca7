#include "core/prt/gather_faces.h"

#include <cmath>

#include "core/mesh/topology.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

// The face normal, turned to the side whose light the vertices hold.
Vec3f lit_side(const Mesh& mesh, const Triangle& t, bool double_sided) {
  const Vec3f face = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
  const Vec3f shading = mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]];
  return double_sided && dot(face, shading) < 0 ? -face : face;
}

}  // namespace

std::uint32_t GatherFaces::pack(const Vec3f& normal) {
  const float sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
  const Vec3f n = normal / sum;
  const float folded = std::max(0.0F, -n.z);
  const auto grid = [](float x) { return static_cast<std::uint32_t>(std::lrint(0.5F * kSteps * (x + 1))); };
  return grid(n.x + std::copysign(folded, n.x)) | grid(n.y + std::copysign(folded, n.y)) << kBits;
}

GatherFaces::GatherFaces(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  const auto material_of = [&](std::uint32_t part) -> const Material& {
    return scene.materials[static_cast<std::size_t>(scene.parts[part].material)];
  };
  std::vector<bool> seen(scene.parts.size(), false);
  plain_.resize(scene.parts.size());
  albedo_.resize(scene.parts.size());
  faces_.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t part = mesh.part[t];
    const Material& material = material_of(part);
    if (!seen[part]) {
      seen[part] = true;
      plain_[part] = material.base_color_texture.texture < 0 && !scene.parts[part].has_color;
      const Vec3f& a = albedo_[part] = albedo_at(scene, surface_point(scene, t, 0, 0));
      grey_ = grey_ && plain_[part] && a.x == a.y && a.y == a.z;
    }
    const Vec3f n = lit_side(mesh, mesh.triangles[t], material.double_sided);
    faces_.push_back(pack(n) | (material.double_sided ? kDoubleSided : 0) | (plain_[part] ? kPlain : 0));
  }
}

}  // namespace kiln
