#include "core/lightfield/progressive_mesh.h"

#include <algorithm>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;

/// Numbers in the order of a progressive mesh: what is left first, then what went last, and so on.
struct Order {
  std::vector<std::uint32_t> vertices, triangles;  // old ones
  std::vector<std::uint32_t> vertex, triangle;     // new number of an old one
};

Order order_of(const CollapseRecord& record) {
  const Mesh& m = record.all.mesh;
  std::vector<bool> gone(m.triangles.size());
  for (const std::uint32_t t : record.removed) gone[t] = true;
  Order out;
  out.vertex.assign(m.position.size(), kNone), out.triangle.assign(m.triangles.size(), kNone);
  std::vector<bool> used(m.position.size());
  for (std::uint32_t t = 0; t < m.triangles.size(); ++t) {
    if (gone[t]) continue;
    out.triangles.push_back(t);
    for (const std::uint32_t v : m.triangles[t]) used[v] = true;
  }
  for (std::uint32_t v = 0; v < used.size(); ++v)
    if (used[v]) out.vertices.push_back(v);
  for (std::size_t s = record.steps.size(); s-- > 0;) {
    const CollapseStep& step = record.steps[s];
    for (std::size_t i = 0; i < step.pairs; ++i) out.vertices.push_back(step.gone[i]);
    for (std::size_t i = s == 0 ? 0 : record.steps[s - 1].orphans; i < step.orphans; ++i)
      out.vertices.push_back(record.orphans[i]);
    for (std::size_t i = s == 0 ? 0 : record.steps[s - 1].removed; i < step.removed; ++i)
      out.triangles.push_back(record.removed[i]);
  }
  for (std::uint32_t i = 0; i < out.vertices.size(); ++i) out.vertex[out.vertices[i]] = i;
  for (std::uint32_t i = 0; i < out.triangles.size(); ++i) out.triangle[out.triangles[i]] = i;
  return out;
}

void set_vertex(LitMesh& to, std::uint32_t vertex, const LitMesh& from, std::uint32_t row) {
  each_attribute_of(to.mesh, from.mesh, [&](auto& a, const auto& b) { a[vertex] = b[row]; });
  each_field_array_of(to.field, from.field, [&](auto& a, const auto& b, std::size_t numbers) {
    std::copy_n(&b[numbers * row], numbers, &a[numbers * vertex]);
  });
}

}  // namespace

ProgressiveMesh progressive_mesh(const CollapseRecord& record) {
  const Order order = order_of(record);
  ProgressiveMesh out;
  out.all.field = out.moved.field = empty_like(record.all.field);
  for (const std::uint32_t v : order.vertices) append_vertex(out.all, record.all, v);
  for (const std::uint32_t t : order.triangles) {
    const auto& [a, b, c] = record.all.mesh.triangles[t];
    out.all.mesh.triangles.push_back({order.vertex[a], order.vertex[b], order.vertex[c]});
    if (!record.all.mesh.part.empty()) out.all.mesh.part.push_back(record.all.mesh.part[t]);
  }
  auto vertices = static_cast<std::uint32_t>(order.vertices.size());
  auto triangles = static_cast<std::uint32_t>(order.triangles.size());
  for (std::size_t s = record.steps.size(); s-- > 0;) {
    const CollapseStep& step = record.steps[s];
    const CollapseStep before = s == 0 ? CollapseStep{} : record.steps[s - 1];
    VertexSplit split{.vertices = step.pairs + static_cast<std::uint32_t>(step.orphans - before.orphans),
                      .triangles = static_cast<std::uint32_t>(step.removed - before.removed),
                      .pairs = step.pairs,
                      .moved = static_cast<std::uint32_t>(step.moved - before.moved),
                      .turned = static_cast<std::uint32_t>(step.turned - before.turned),
                      .error = step.error};
    for (std::uint32_t i = 0; i < step.pairs; ++i) split.parent[i] = order.vertex[step.kept[i]];
    for (std::size_t i = before.moved; i < step.moved; ++i) {
      out.moved_vertex.push_back(order.vertex[record.moved[i]]);
      append_vertex(out.moved, record.before, static_cast<std::uint32_t>(i));
    }
    for (std::size_t i = before.turned; i < step.turned; ++i)
      out.turned.push_back(2 * order.triangle[record.turned[i] / 2] + record.turned[i] % 2);
    vertices -= split.vertices, triangles -= split.triangles;
    out.splits.push_back(split);
  }
  out.base_vertices = vertices, out.base_triangles = triangles;
  return out;
}

LitMesh at_level(const ProgressiveMesh& p, std::size_t splits) {
  EXPECTS(splits <= p.splits.size());
  std::uint32_t vertices = p.base_vertices, triangles = p.base_triangles, row = 0;
  std::size_t turned = 0;
  LitMesh out = p.all;
  for (std::size_t s = 0; s < splits; ++s) {
    const VertexSplit& split = p.splits[s];
    for (std::uint32_t i = 0; i < split.moved; ++i, ++row) set_vertex(out, p.moved_vertex[row], p.moved, row);
    for (std::uint32_t k = 0; k < split.turned; ++k, ++turned) {
      const std::uint32_t i = p.turned[turned] % 2;
      std::ranges::replace(out.mesh.triangles[p.turned[turned] / 2], split.parent[i], vertices + i);
    }
    vertices += split.vertices, triangles += split.triangles;
  }
  each_attribute(out.mesh, [&](auto& array) { array.resize(vertices); });
  each_field_array(out.field, [&](auto& array, std::size_t numbers) { array.resize(numbers * vertices); });
  out.mesh.triangles.resize(triangles);
  if (!out.mesh.part.empty()) out.mesh.part.resize(triangles);
  return out;
}

float level_error(const ProgressiveMesh& p, std::size_t splits) {
  EXPECTS(splits <= p.splits.size());
  return splits < p.splits.size() ? p.splits[splits].error : 0;
}

std::size_t level_of_triangles(const ProgressiveMesh& p, std::size_t triangles) {
  std::size_t level = 0, count = p.base_triangles;
  for (; level < p.splits.size(); ++level) {
    count += p.splits[level].triangles;
    if (count > triangles) break;
  }
  return level;
}

}  // namespace kiln
