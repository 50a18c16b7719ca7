#include "core/lightfield/lit_mesh.h"

#include <algorithm>

#include "core/mesh/midpoint.h"

namespace kiln {
std::uint32_t append_vertex(LitMesh& to, const LitMesh& from, std::uint32_t vertex) {
  const auto index = static_cast<std::uint32_t>(to.mesh.position.size());
  each_attribute_of(to.mesh, from.mesh, [&](auto& a, const auto& b) {
    const auto copy = b[vertex];  // `a` may be `b`
    a.push_back(copy);
  });
  const std::size_t row = from.field.row(), at = to.field.coefficients.size();
  to.field.coefficients.resize(at + row);
  std::copy_n(from.field.coefficients.begin() + static_cast<std::ptrdiff_t>(row * vertex), row,
              to.field.coefficients.begin() + static_cast<std::ptrdiff_t>(at));
  return index;
}

void draw_towards(LitMesh& lit, std::uint32_t to, std::uint32_t from, float share) {
  append_between(lit.mesh, from, to, share);
  each_attribute(lit.mesh, [&](auto& array) {
    array[to] = array.back();
    array.pop_back();
  });
  const auto a = lit.field.of(from), b = lit.field.of(to);
  for (std::size_t i = 0; i < b.size(); ++i) b[i] = (1 - share) * a[i] + share * b[i];
}

void drop_unused_vertices(LitMesh& lit) {
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> to(lit.mesh.position.size(), kUnused);
  for (const Triangle& t : lit.mesh.triangles)
    for (const std::uint32_t v : t) to[v] = 0;
  std::uint32_t next = 0;
  const std::size_t row = lit.field.row();
  for (std::uint32_t v = 0; v < to.size(); ++v) {
    if (to[v] == kUnused) continue;
    each_attribute(lit.mesh, [&](auto& array) { array[next] = array[v]; });
    const float* from = lit.field.coefficients.data() + row * v;
    std::copy(from, from + row, lit.field.coefficients.data() + row * next);
    to[v] = next++;
  }
  each_attribute(lit.mesh, [&](auto& array) { array.resize(next); });
  lit.field.coefficients.resize(row * next);
  for (Triangle& t : lit.mesh.triangles) t = {to[t[0]], to[t[1]], to[t[2]]};
}

}  // namespace kiln
