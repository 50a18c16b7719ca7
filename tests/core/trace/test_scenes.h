#pragma once
// Small scenes whose light is known in closed form.

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/scene/scene.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"

namespace kiln::test {

/// Adds a material and returns its index.
inline int add_material(Scene& scene, const Vec3f& albedo, const Vec3f& emission = {}, bool double_sided = false) {
  Material material;
  material.base_color = {albedo.x, albedo.y, albedo.z, 1};
  material.emission = emission;
  material.double_sided = double_sided;
  scene.materials.push_back(material);
  return static_cast<int>(scene.materials.size()) - 1;
}

/// Adds the parallelogram corner, corner + a, corner + b as a part of two triangles; its front looks along a x b.
inline void add_quad(Scene& scene, const Vec3f& corner, const Vec3f& a, const Vec3f& b, int material) {
  Mesh& mesh = scene.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  const Vec3f normal = normalized(cross(a, b));
  for (const Vec3f& p : {corner, corner + a, corner + a + b, corner + b}) {
    mesh.position.push_back(p);
    mesh.normal.push_back(normal);
  }
  for (const Vec2f& uv : {Vec2f{0, 0}, Vec2f{1, 0}, Vec2f{1, 1}, Vec2f{0, 1}}) mesh.uv0.push_back(uv);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  mesh.part.insert(mesh.part.end(), 2, static_cast<std::uint32_t>(scene.parts.size()));
  scene.parts.push_back({.name = "quad", .material = material, .has_uv0 = true});
}

/// A closed cube of half width `h` whose fronts look inwards.
inline void add_room(Scene& scene, float h, int material) {
  const Vec3f x{2 * h, 0, 0}, y{0, 2 * h, 0}, z{0, 0, 2 * h}, low{-h, -h, -h}, high{h, h, h};
  add_quad(scene, low, z, x, material);     // floor, looks up
  add_quad(scene, low, x, y, material);     // looks along +z
  add_quad(scene, low, y, z, material);     // looks along +x
  add_quad(scene, high, -x, -z, material);  // ceiling
  add_quad(scene, high, -y, -x, material);
  add_quad(scene, high, -z, -y, material);
}

/// A sphere of latitude rings, fronts outwards, smooth normals; centre at the origin.
inline void add_sphere(Scene& scene, float radius, int rings, int material) {
  Mesh& mesh = scene.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  const int around = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k <= around; ++k) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * k / around;
      const Vec3f n =
          to_float(Vec3d{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
      mesh.normal.push_back(n);
      mesh.position.push_back(n * radius);
      mesh.uv0.push_back({});
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const std::uint32_t a = first + static_cast<std::uint32_t>(i * (around + 1) + k), b = a + 1;
      const std::uint32_t c = a + static_cast<std::uint32_t>(around + 1), d = c + 1;
      if (i > 0) mesh.triangles.push_back({a, b, c});
      if (i < rings - 1) mesh.triangles.push_back({b, d, c});
    }
  }
  mesh.part.resize(mesh.triangles.size(), static_cast<std::uint32_t>(scene.parts.size()));
  scene.parts.push_back({.name = "sphere", .material = material});
}

/// An image of w x h RGBA texels and a texture for it; returns the texture's index.
inline int add_texture(Scene& scene, int w, int h, std::vector<std::uint8_t> rgba, Wrap wrap = Wrap::clamp,
                       bool nearest = true) {
  Image image;
  image.width = w;
  image.height = h;
  image.rgba = std::move(rgba);
  scene.images.push_back(std::move(image));
  scene.textures.push_back({static_cast<int>(scene.images.size()) - 1, wrap, wrap, nearest});
  return static_cast<int>(scene.textures.size()) - 1;
}

/// Uniform points of the triangles [first, last) of the scene's mesh.
inline std::vector<ReferencePoint> points_on(const Scene& scene, std::size_t first, std::size_t last, int count,
                                             std::uint64_t seed = 1) {
  std::vector<ReferencePoint> points;
  for (int i = 0; i < count; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const auto t = static_cast<std::uint32_t>(first + random.next() % (last - first));
    const float root = std::sqrt(random.uniform()), other = random.uniform();
    const SurfacePoint p = surface_point(scene, t, root * (1 - other), root * other);
    points.push_back({p.position, p.normal, p.geometric_normal});
  }
  return points;
}

}  // namespace kiln::test
