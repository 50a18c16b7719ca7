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

}  // namespace kiln
