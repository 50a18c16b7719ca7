#include "tests/core/prt/test_scenes.h"

#include <cmath>
#include <numbers>

#include "core/mesh/topology.h"

namespace kiln::testing {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

std::uint32_t add_vertex(Scene& scene, const Vec3f& position, const Vec3f& normal) {
  scene.mesh.position.push_back(position);
  scene.mesh.normal.push_back(normalized(normal));
  return static_cast<std::uint32_t>(scene.mesh.position.size() - 1);
}

void add_triangle(Scene& scene, const Triangle& t, std::uint32_t part) {
  scene.mesh.triangles.push_back(t);
  scene.mesh.part.push_back(part);
}

void add_quad(Scene& scene, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, std::uint32_t part) {
  add_triangle(scene, {a, b, c}, part);
  add_triangle(scene, {a, c, d}, part);
}

void scale(Scene& scene, float factor, const Vec3f& shift) {
  for (Vec3f& p : scene.mesh.position) p = p * factor + shift;
}

struct BoxCells {
  int across, up, top;
};

// Four sides and a top; it stands on something.
void add_standing_box(Scene& scene, const Vec3f& low, const Vec3f& high, const BoxCells& cells) {
  const Vec3f x{high.x - low.x, 0, 0}, y{0, high.y - low.y, 0}, z{0, 0, high.z - low.z};
  add_grid(scene, low + z, x, y, cells.across, cells.up);
  add_grid(scene, low + z + x, -z, y, cells.across, cells.up);
  add_grid(scene, low + x, -x, y, cells.across, cells.up);
  add_grid(scene, low, z, y, cells.across, cells.up);
  add_grid(scene, low + y + z, x, -z, cells.top, 1);
}

Vec3f knot_curve(float t) {
  const float r = 2 + std::cos(3 * t);
  return {r * std::cos(2 * t), std::sin(3 * t), r * std::sin(2 * t)};
}

void add_knot(Scene& scene, float size, const Vec3f& shift, int along, int around) {
  const auto first = static_cast<std::uint32_t>(scene.mesh.position.size());
  for (int i = 0; i < along; ++i) {
    const float t = 2 * kPi * static_cast<float>(i) / static_cast<float>(along);
    const Vec3f center = knot_curve(t), tangent = normalized(knot_curve(t + 0.01F) - knot_curve(t - 0.01F));
    const Vec3f side = normalized(cross(tangent, Vec3f{0, 1, 0})), over = cross(side, tangent);
    for (int j = 0; j < around; ++j) {
      const float a = 2 * kPi * static_cast<float>(j) / static_cast<float>(around);
      const Vec3f out = side * std::cos(a) + over * std::sin(a);
      add_vertex(scene, (center + out * 0.4F) * size + shift, out);
    }
  }
  const auto id = [&](int i, int j) { return first + static_cast<std::uint32_t>((i % along) * around + j % around); };
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < around; ++j) add_quad(scene, id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j), 0);
  }
}

}  // namespace

Scene empty_scene() {
  Scene scene;
  scene.materials.push_back({.name = "white"});
  scene.parts.push_back({.name = "part", .material = 0});
  return scene;
}

std::uint32_t add_part(Scene& scene, const Vec3f& albedo, bool double_sided) {
  Material material{.name = "material"};
  material.base_color = {albedo.x, albedo.y, albedo.z, 1};
  material.double_sided = double_sided;
  scene.materials.push_back(material);
  scene.parts.push_back({.name = "part", .material = static_cast<int>(scene.materials.size() - 1)});
  return static_cast<std::uint32_t>(scene.parts.size() - 1);
}

void add_grid(Scene& scene, const Vec3f& corner, const Vec3f& across, const Vec3f& up, int columns, int rows,
              std::uint32_t part) {
  const auto first = static_cast<std::uint32_t>(scene.mesh.position.size());
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const Vec3f along = across * (static_cast<float>(i) / static_cast<float>(columns));
      add_vertex(scene, corner + along + up * (static_cast<float>(j) / static_cast<float>(rows)), cross(across, up));
    }
  }
  const auto id = [&](int i, int j) { return first + static_cast<std::uint32_t>(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) add_quad(scene, id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1), part);
  }
}

void add_box(Scene& scene, const Vec3f& low, const Vec3f& high, int cells, bool inside_out, std::uint32_t part) {
  const Vec3f size = high - low;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3f across{}, up{};
    across[(axis + 1) % 3] = size[(axis + 1) % 3];
    up[(axis + 2) % 3] = size[(axis + 2) % 3];
    Vec3f far = low;
    far[axis] = high[axis];
    if (inside_out) std::swap(across, up);
    add_grid(scene, far, across, up, cells, cells, part);
    add_grid(scene, low, up, across, cells, cells, part);
  }
}

void add_sphere(Scene& scene, const Vec3f& center, float radius, int rings, std::uint32_t part) {
  const int segments = 2 * rings;
  const auto first = static_cast<std::uint32_t>(scene.mesh.position.size());
  for (int i = 0; i <= rings; ++i) {
    const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
    for (int j = 0; j < segments; ++j) {
      const float phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(segments);
      const Vec3f n{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
      add_vertex(scene, center + n * radius, n);
    }
  }
  const auto id = [&](int i, int j) { return first + static_cast<std::uint32_t>(i * segments + j % segments); };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < segments; ++j) add_quad(scene, id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j), part);
  }
}

Scene column_scene() {
  Scene scene = empty_scene();
  add_grid(scene, {-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 10, 10);
  add_standing_box(scene, {-0.45F, 0, -0.45F}, {0.45F, 4, 0.45F}, {1, 5, 3});
  scale(scene, 0.1F, {0, -0.2F, 0});
  return scene;
}

Scene knot_scene() {
  Scene scene = empty_scene();
  add_grid(scene, {-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 10, 10);
  add_knot(scene, 1, {0, 1.6F, 0}, 96, 8);
  scale(scene, 0.1F, {0, -0.2F, 0});
  return scene;
}

Scene room_scene() {
  Scene scene = empty_scene();
  constexpr int kCells = 4;
  add_grid(scene, {-0.5F, -0.5F, 0.5F}, {1, 0, 0}, {0, 0, -1}, kCells, kCells);  // floor
  add_grid(scene, {-0.5F, 0.5F, -0.5F}, {1, 0, 0}, {0, 0, 1}, kCells, kCells);   // ceiling
  add_grid(scene, {-0.5F, -0.5F, -0.5F}, {1, 0, 0}, {0, 1, 0}, kCells, kCells);  // back
  add_grid(scene, {-0.5F, -0.5F, 0.5F}, {0, 0, -1}, {0, 1, 0}, kCells, kCells);  // left
  add_grid(scene, {0.5F, -0.5F, -0.5F}, {0, 0, 1}, {0, 1, 0}, kCells, kCells);   // right
  add_standing_box(scene, {-0.31F, -0.5F, -0.28F}, {-0.04F, 0.07F, -0.03F}, {1, 1, 1});
  add_standing_box(scene, {0.07F, -0.5F, 0.02F}, {0.34F, -0.22F, 0.29F}, {1, 1, 1});
  return scene;
}

Scene random_scene(std::uint64_t seed, int triangles) {
  Scene scene = empty_scene();
  add_part(scene, {0.5F, 0.5F, 0.5F});
  Random random(seed, 0);
  const auto below = [&](int n) { return static_cast<int>(random.next() % static_cast<std::uint64_t>(n)); };
  const auto lattice = [&] { return 0.25F * static_cast<float>(below(4)) - 0.375F; };
  const int points = triangles;
  for (int i = 0; i < 2 * points; ++i) {  // every position may come again: a seam
    add_vertex(scene, {lattice(), lattice(), lattice()}, {lattice(), lattice(), lattice()});
  }
  for (int i = 0; i < triangles; ++i) {
    const int half = below(2);  // a vertex belongs to one part only
    const auto vertex = [&] { return static_cast<std::uint32_t>(half * points + below(points)); };
    add_triangle(scene, {vertex(), vertex(), vertex()}, static_cast<std::uint32_t>(half));
  }
  return scene;
}

}  // namespace kiln::testing
