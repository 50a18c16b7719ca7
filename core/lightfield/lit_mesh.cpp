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
  each_field_array_of(to.field, from.field, [&](auto& a, const auto& b, std::size_t row) {
    a.resize(a.size() + row);
    std::copy_n(b.begin() + static_cast<std::ptrdiff_t>(row * vertex), row, a.end() - static_cast<std::ptrdiff_t>(row));
  });
  return index;
}

void draw_towards(LitMesh& lit, std::uint32_t to, std::uint32_t from, float share) {
  append_between(lit.mesh, from, to, share);
  each_attribute(lit.mesh, [&](auto& array) {
    array[to] = array.back();
    array.pop_back();
  });
  each_field_array(lit.field, [&](auto& array, std::size_t row) {
    const float* a = &array[row * from];
    float* b = &array[row * to];
    for (std::size_t i = 0; i < row; ++i) b[i] = (1 - share) * a[i] + share * b[i];
  });
}

void drop_unused_vertices(LitMesh& lit) {
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> to(lit.mesh.position.size(), kUnused);
  for (const Triangle& t : lit.mesh.triangles)
    for (const std::uint32_t v : t) to[v] = 0;
  std::uint32_t next = 0;
  for (std::uint32_t v = 0; v < to.size(); ++v) {
    if (to[v] == kUnused) continue;
    each_attribute(lit.mesh, [&](auto& array) { array[next] = array[v]; });
    each_field_array(lit.field, [&](auto& array, std::size_t row) {
      const float* from = array.data() + row * v;
      std::copy(from, from + row, array.data() + row * next);
    });
    to[v] = next++;
  }
  each_attribute(lit.mesh, [&](auto& array) { array.resize(next); });
  each_field_array(lit.field, [&](auto& array, std::size_t row) { array.resize(row * next); });
  for (Triangle& t : lit.mesh.triangles) t = {to[t[0]], to[t[1]], to[t[2]]};
}

}  // namespace kiln
