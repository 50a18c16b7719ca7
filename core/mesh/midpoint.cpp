#include "core/mesh/midpoint.h"

#include <algorithm>

namespace kiln {
namespace {

float middle(float a, float b) { return 0.5F * a + 0.5F * b; }  // no sum that could be too large
Vec2f middle(const Vec2f& a, const Vec2f& b) { return {middle(a.x, b.x), middle(a.y, b.y)}; }
Vec4f middle(const Vec4f& a, const Vec4f& b) {
  return {middle(a.x, b.x), middle(a.y, b.y), middle(a.z, b.z), middle(a.w, b.w)};
}

Vec4f middle_tangent(const Vec4f& a, const Vec4f& b) {
  const Vec3f along = normalized(Vec3f{a.x + b.x, a.y + b.y, a.z + b.z}, Vec3f{a.x, a.y, a.z});
  return {along.x, along.y, along.z, a.w};
}

}  // namespace

Vec3f middle_normal(const Mesh& mesh, std::uint32_t first, std::uint32_t second) {
  const auto [a, b] = std::minmax(first, second);
  return normalized(mesh.normal[a] + mesh.normal[b], mesh.normal[a]);
}

std::uint32_t append_midpoint(Mesh& mesh, std::uint32_t first, std::uint32_t second) {
  const auto [a, b] = std::minmax(first, second);
  const auto vertex = static_cast<std::uint32_t>(mesh.position.size());
  mesh.position.push_back(middle(mesh.position[a], mesh.position[b]));
  mesh.normal.push_back(middle_normal(mesh, a, b));
  if (!mesh.uv0.empty()) mesh.uv0.push_back(middle(mesh.uv0[a], mesh.uv0[b]));
  if (!mesh.uv1.empty()) mesh.uv1.push_back(middle(mesh.uv1[a], mesh.uv1[b]));
  if (!mesh.color.empty()) mesh.color.push_back(middle(mesh.color[a], mesh.color[b]));
  if (!mesh.tangent.empty()) mesh.tangent.push_back(middle_tangent(mesh.tangent[a], mesh.tangent[b]));
  return vertex;
}

std::uint32_t append_between(Mesh& mesh, std::uint32_t a, std::uint32_t b, float share) {
  const auto mix = [share](float x, float y) { return (1 - share) * x + share * y; };
  const auto vertex = static_cast<std::uint32_t>(mesh.position.size());
  const auto mix3 = [&](const Vec3f& x, const Vec3f& y) { return Vec3f{mix(x.x, y.x), mix(x.y, y.y), mix(x.z, y.z)}; };
  const auto mix2 = [&](const Vec2f& x, const Vec2f& y) { return Vec2f{mix(x.x, y.x), mix(x.y, y.y)}; };
  mesh.position.push_back(mix3(mesh.position[a], mesh.position[b]));
  mesh.normal.push_back(normalized(mix3(mesh.normal[a], mesh.normal[b]), mesh.normal[a]));
  if (!mesh.uv0.empty()) mesh.uv0.push_back(mix2(mesh.uv0[a], mesh.uv0[b]));
  if (!mesh.uv1.empty()) mesh.uv1.push_back(mix2(mesh.uv1[a], mesh.uv1[b]));
  if (!mesh.color.empty()) {
    const Vec4f &x = mesh.color[a], &y = mesh.color[b];
    mesh.color.push_back({mix(x.x, y.x), mix(x.y, y.y), mix(x.z, y.z), mix(x.w, y.w)});
  }
  if (!mesh.tangent.empty()) {
    const Vec4f &x = mesh.tangent[a], &y = mesh.tangent[b];
    const Vec3f along = normalized(mix3({x.x, x.y, x.z}, {y.x, y.y, y.z}), {x.x, x.y, x.z});
    mesh.tangent.push_back({along.x, along.y, along.z, x.w});
  }
  return vertex;
}

}  // namespace kiln
