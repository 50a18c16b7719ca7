#include "core/artifact/assemble.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lightfield/radiance_function.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr double kMaxCoordinate = 1e18;

struct Bounds {
  Vec3d low{std::numeric_limits<double>::max(), std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  Vec3d high{-low};

  void add(const Vec3d& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
};

bool in_range(const Vec3d& p) {
  return std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate && std::abs(p.z) <= kMaxCoordinate;
}

Bounds world_bounds(const std::vector<RawPart>& parts, const std::vector<PlacedPart>& placed, Findings& findings) {
  Bounds bounds;
  for (const PlacedPart& place : placed) {
    const RawPart& part = parts[place.part];
    for (const Affine& to_world : place.instances) {
      for (std::size_t v = 0; v < part.position.size(); ++v) {
        const Vec3d p = to_world.point(to_double(part.position[v]));
        if (!in_range(p)) {
          findings.fail("position_out_of_range", "A position is further than 1e18 from the origin.",
                        part.place + "/attributes/POSITION element " + std::to_string(v));
          return bounds;
        }
        bounds.add(p);
      }
    }
  }
  return bounds;
}

Frame frame_of(const Bounds& b) {
  const Vec3d size = b.high - b.low;
  const double scale = std::max({size.x, size.y, size.z});
  return {.center = (b.low + b.high) * 0.5, .scale = scale > 0 ? scale : 1};
}

Vec3f to_cube(const Vec3d& unit) {
  const auto clamp = [](double x) { return std::clamp(x, -0.5, 0.5); };
  return to_float({clamp(unit.x), clamp(unit.y), clamp(unit.z)});
}

/// Which optional attributes the mesh as a whole needs.
struct Wanted {
  bool uv0 = false, uv1 = false, color = false, tangent = false;
};

template <class T>
void append(std::vector<T>& out, const std::vector<T>& values, std::size_t count, bool wanted, const T& absent) {
  if (!wanted) return;
  if (values.empty()) {
    out.insert(out.end(), count, absent);
  } else {
    out.insert(out.end(), values.begin(), values.end());
  }
}

void append_tangents(const RawPart& part, const Affine& to_world, double sign, std::vector<Vec4f>& out) {
  for (const Vec4f& t : part.tangent) {
    const Vec3f moved = to_float(normalized(to_world.vector(to_double(Vec3f{t.x, t.y, t.z})), Vec3d{1, 0, 0}));
    out.push_back({moved.x, moved.y, moved.z, t.w * static_cast<float>(sign)});
  }
}

void append_vertices(const RawPart& part, const Affine& to_world, const Wanted& wanted, const Frame& frame,
                     Mesh& mesh) {
  const double sign = to_world.determinant() < 0 ? -1 : 1;
  const Affine area = cofactors(to_world);
  const std::size_t count = part.position.size();
  for (std::size_t v = 0; v < count; ++v) {
    mesh.position.push_back(to_cube(frame.to_unit(to_world.point(to_double(part.position[v])))));
    mesh.normal.push_back(to_float(normalized(area.vector(to_double(part.normal[v])) * sign)));
  }
  append(mesh.uv0, part.uv0, count, wanted.uv0, Vec2f{});
  append(mesh.uv1, part.uv1, count, wanted.uv1, Vec2f{});
  append(mesh.color, part.color, count, wanted.color, Vec4f{1, 1, 1, 1});
  if (wanted.tangent && part.tangent.empty()) append(mesh.tangent, {}, count, true, Vec4f{1, 0, 0, 1});
  if (wanted.tangent) append_tangents(part, to_world, sign, mesh.tangent);
}

/// `to_world` as a turn of directions, after a flip of their sign where it mirrors; it scales evenly.
Basis<double> turn_of(const Affine& to_world) {
  const double sign = to_world.determinant() < 0 ? -1 : 1;
  const Vec3d x = normalized(to_world.x * sign), z = normalized(cross(x, to_world.y * sign));
  return {x, cross(z, x), z};
}

/// The r-RFs of the vertices that append_vertices() added last.
void append_radiance(const RawPart& part, const Affine& to_world, LitScene& lit) {
  const Basis<double> turn = turn_of(to_world);
  const bool mirrored = to_world.determinant() < 0;
  const int degree = lit.field.degree;
  const std::size_t count = lit.field.count(), first = lit.scene.mesh.normal.size() - part.position.size();
  std::vector<double> c(count);
  for (std::size_t at = 0; at < part.radiance.size(); at += count) {
    std::copy_n(part.radiance.begin() + static_cast<std::ptrdiff_t>(at), count, c.begin());
    for (int l = 1; l <= degree && mirrored; l += 2) {
      for (int i = l * l; i < (l + 1) * (l + 1); ++i) c[static_cast<std::size_t>(i)] *= -1;
    }
    rotate_sh(degree + 1, turn, c.data(), c.data());
    reflect_harmonics(degree, to_double(lit.scene.mesh.normal[first + at / (3 * count)]), c.data());
    for (const double x : c) lit.field.coefficients.push_back(static_cast<float>(x));
  }
}

/// In the unit cube a face needs an area whose square a float holds, and corners that rounding has not joined.
bool vanished(const Mesh& mesh, const Triangle& t) {
  constexpr double kLeastTwiceArea = 1e-18;
  const Vec3d a = to_double(mesh.position[t[0]]), b = to_double(mesh.position[t[1]]),
              c = to_double(mesh.position[t[2]]);
  return is_degenerate(a, b, c) || length(cross(b - a, c - a)) < kLeastTwiceArea;
}

/// Returns how many triangles rounding to the unit cube has made vanish.
std::uint64_t append_triangles(const RawPart& part, bool mirrored, std::size_t first, std::uint32_t index, Mesh& mesh) {
  std::uint64_t lost = 0;
  for (const Triangle& t : part.triangles) {
    const auto v = [&](std::size_t i) { return static_cast<std::uint32_t>(first + t[i]); };
    const Triangle moved = mirrored ? Triangle{v(0), v(2), v(1)} : Triangle{v(0), v(1), v(2)};
    if (vanished(mesh, moved)) {
      ++lost;
      continue;
    }
    mesh.triangles.push_back(moved);
    mesh.part.push_back(index);
  }
  return lost;
}

void append_placed(const RawPart& part, const PlacedPart& place, const Wanted& wanted, LitScene& lit,
                   Findings& findings) {
  Scene& scene = lit.scene;
  const auto index = static_cast<std::uint32_t>(scene.parts.size());
  std::uint64_t lost = 0;
  for (const Affine& to_world : place.instances) {
    const std::size_t first = scene.mesh.position.size();
    append_vertices(part, to_world, wanted, scene.frame, scene.mesh);
    append_radiance(part, to_world, lit);
    lost += append_triangles(part, to_world.determinant() < 0, first, index, scene.mesh);
  }
  if (lost > 0) {
    findings.warn("degenerate_triangles_dropped",
                  std::to_string(lost) + " triangles have no area beside the size of the scene.", part.place);
  }
  scene.parts.push_back({.name = place.name,
                         .material = part.material,
                         .has_uv0 = !part.uv0.empty(),
                         .has_uv1 = !part.uv1.empty(),
                         .has_color = !part.color.empty(),
                         .has_tangent = !part.tangent.empty()});
}

/// Vertices that only vanished triangles used go; order stays.
void drop_unused_vertices(LitScene& lit) {
  Mesh& mesh = lit.scene.mesh;
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> now(mesh.position.size(), kUnused);
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) now[v] = 0;
  }
  std::uint32_t kept = 0;
  for (std::uint32_t& v : now) {
    if (v != kUnused) v = kept++;
  }
  if (kept == now.size()) return;
  const auto compact = [&](auto& values) {
    if (values.empty()) return;
    for (std::size_t v = 0; v < now.size(); ++v) {
      if (now[v] != kUnused) values[now[v]] = values[v];
    }
    values.resize(kept);
  };
  std::vector<float>& rows = lit.field.coefficients;
  const auto width = static_cast<std::ptrdiff_t>(rows.size() / now.size());
  for (std::size_t v = 0; v < now.size() && width > 0; ++v) {
    if (now[v] != kUnused)
      std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(v) * width, width,
                  rows.begin() + std::ptrdiff_t{now[v]} * width);
  }
  rows.resize(static_cast<std::size_t>(width) * kept);
  compact(mesh.position);
  compact(mesh.normal);
  compact(mesh.uv0);
  compact(mesh.uv1);
  compact(mesh.color);
  compact(mesh.tangent);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = now[v];
  }
}

void reserve(const std::vector<RawPart>& parts, const std::vector<PlacedPart>& placed, Wanted& wanted, Mesh& mesh) {
  std::size_t vertices = 0, triangles = 0;
  for (const PlacedPart& place : placed) {
    const RawPart& part = parts[place.part];
    vertices += part.position.size() * place.instances.size();
    triangles += part.triangles.size() * place.instances.size();
    wanted.uv0 |= !part.uv0.empty();
    wanted.uv1 |= !part.uv1.empty();
    wanted.color |= !part.color.empty();
    wanted.tangent |= !part.tangent.empty();
  }
  mesh.position.reserve(vertices);
  mesh.normal.reserve(vertices);
  mesh.triangles.reserve(triangles);
  mesh.part.reserve(triangles);
}

}  // namespace

void check_expanded_size(std::uint64_t vertices, std::uint64_t triangles, std::uint64_t row, const ImportLimits& limits,
                         Findings& findings) {
  const std::uint64_t bytes = mesh_bytes(vertices, triangles) + vertices * row;
  if (triangles > limits.max_triangles) {
    findings.fail("scene_too_large", "With its instances the scene has " + std::to_string(triangles) +
                                         " triangles, the limit is " + std::to_string(limits.max_triangles) + ".");
  } else if (bytes > limits.max_memory_bytes || vertices > std::numeric_limits<std::uint32_t>::max()) {
    findings.fail("scene_too_large", "With its instances the scene takes " + std::to_string(bytes >> 20) +
                                         " MiB, the limit is " + std::to_string(limits.max_memory_bytes >> 20) +
                                         " MiB.");
  }
}

void assemble(const std::vector<RawPart>& parts, const std::vector<PlacedPart>& placed, const ImportLimits& limits,
              LitScene& lit, Findings& findings) {
  Scene& scene = lit.scene;
  Wanted wanted;
  std::uint64_t vertices = 0, triangles = 0, row = 0;
  for (const PlacedPart& place : placed) {
    vertices += parts[place.part].position.size() * place.instances.size();
    triangles += parts[place.part].triangles.size() * place.instances.size();
    if (!parts[place.part].radiance.empty()) row = 3 * lit.field.count() * sizeof(float);
  }
  check_expanded_size(vertices, triangles, row, limits, findings);
  if (findings.failed()) return;
  reserve(parts, placed, wanted, scene.mesh);
  if (triangles > 0) scene.frame = frame_of(world_bounds(parts, placed, findings));
  for (std::size_t i = 0; i < placed.size() && !findings.failed(); ++i) {
    if (parts[placed[i].part].triangles.empty()) continue;
    append_placed(parts[placed[i].part], placed[i], wanted, lit, findings);
  }
  drop_unused_vertices(lit);
  if (scene.mesh.triangles.empty()) findings.fail("empty_scene", "The scene has no triangle to bake.");
}

}  // namespace kiln
