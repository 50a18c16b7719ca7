#include "core/mesh/midpoint.h"

#include <algorithm>
#include <initializer_list>
#include <utility>

namespace kiln {
namespace {

float middle(float a, float b) { return 0.5F * a + 0.5F * b; }  // no sum that could be too large
Vec2f middle(const Vec2f& a, const Vec2f& b) { return {middle(a.x, b.x), middle(a.y, b.y)}; }
Vec4f middle(const Vec4f& a, const Vec4f& b) {
  return {middle(a.x, b.x), middle(a.y, b.y), middle(a.z, b.z), middle(a.w, b.w)};
}

Vec2f plus(const Vec2f& sum, const Vec2f& x, float weight) { return {sum.x + weight * x.x, sum.y + weight * x.y}; }
Vec3f plus(const Vec3f& sum, const Vec3f& x, float weight) { return sum + x * weight; }
Vec4f plus(const Vec4f& sum, const Vec4f& x, float weight) {
  return {sum.x + weight * x.x, sum.y + weight * x.y, sum.z + weight * x.z, sum.w + weight * x.w};
}

Vec4f middle_tangent(const Vec4f& a, const Vec4f& b) {
  const Vec3f along = normalized(Vec3f{a.x + b.x, a.y + b.y, a.z + b.z}, Vec3f{a.x, a.y, a.z});
  return {along.x, along.y, along.z, a.w};
}

/// Weighted sum of what some vertices have; `first` lends what cannot be summed.
template <class Member>
auto mixed(const std::vector<Member>& values, std::initializer_list<std::pair<std::uint32_t, float>> of) {
  Member sum{};
  for (const auto& [vertex, weight] : of) sum = plus(sum, values[vertex], weight);
  return sum;
}

std::uint32_t append_mixed(Mesh& mesh, std::uint32_t first, std::initializer_list<std::pair<std::uint32_t, float>> of) {
  const auto vertex = static_cast<std::uint32_t>(mesh.position.size());
  mesh.position.push_back(mixed(mesh.position, of));
  mesh.normal.push_back(normalized(mixed(mesh.normal, of), mesh.normal[first]));
  if (!mesh.uv0.empty()) mesh.uv0.push_back(mixed(mesh.uv0, of));
  if (!mesh.uv1.empty()) mesh.uv1.push_back(mixed(mesh.uv1, of));
  if (!mesh.color.empty()) mesh.color.push_back(mixed(mesh.color, of));
  if (!mesh.tangent.empty()) {
    const Vec4f sum = mixed(mesh.tangent, of), own = mesh.tangent[first];
    const Vec3f along = normalized(Vec3f{sum.x, sum.y, sum.z}, Vec3f{own.x, own.y, own.z});
    mesh.tangent.push_back({along.x, along.y, along.z, own.w});
  }
  return vertex;
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
  return append_mixed(mesh, a, {std::pair(a, 1 - share), std::pair(b, share)});
}

std::uint32_t append_inside(Mesh& mesh, const Triangle& t, float u, float v) {
  return append_mixed(mesh, t[0], {std::pair(t[0], 1 - u - v), std::pair(t[1], u), std::pair(t[2], v)});
}

}  // namespace kiln
