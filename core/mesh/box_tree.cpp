#include "core/mesh/box_tree.h"

#include <algorithm>
#include <numeric>

#include "core/mesh/topology.h"

namespace kiln {

void Box::add(const Vec3f& p) {
  low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
  high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
}

int Box::longest_axis() const {
  const Vec3f size = high - low;
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

bool Box::overlaps(const Box& other) const {
  return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y &&
         low.z <= other.high.z && other.low.z <= high.z;
}

double squared_distance(const Box& box, const Vec3d& p) {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double out = std::max({double(box.low[axis]) - p[axis], p[axis] - double(box.high[axis]), 0.0});
    sum += out * out;
  }
  return sum;
}

Box triangle_box(const Mesh& mesh, const Triangle& t) {
  Box box;
  for (const std::uint32_t vertex : t) box.add(mesh.position[vertex]);
  return box;
}

BoxTree::BoxTree(const Mesh& mesh) : order(mesh.triangles.size()) {
  constexpr std::uint32_t kLeafSize = 4;
  std::iota(order.begin(), order.end(), 0U);
  if (order.empty()) return;
  nodes.reserve(order.size());
  nodes.push_back({{}, 0, static_cast<std::uint32_t>(order.size())});
  for (std::size_t node = 0; node < nodes.size(); ++node) {
    for (std::uint32_t i = 0; i < nodes[node].count; ++i) {
      const Box box = triangle_box(mesh, mesh.triangles[order[nodes[node].first + i]]);
      nodes[node].box.add(box.low);
      nodes[node].box.add(box.high);
    }
    if (nodes[node].count > kLeafSize) split(mesh, node);
  }
}

void BoxTree::split(const Mesh& mesh, std::size_t index) {
  const std::uint32_t first = nodes[index].first, count = nodes[index].count, half = count / 2;
  Box centers;
  for (std::uint32_t i = first; i < first + count; ++i) centers.add(centroid(mesh, mesh.triangles[order[i]]));
  const auto axis = static_cast<std::size_t>(centers.longest_axis());
  const auto begin = order.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    const float ca = centroid(mesh, mesh.triangles[a])[axis], cb = centroid(mesh, mesh.triangles[b])[axis];
    return ca < cb || (ca == cb && a < b);
  });
  nodes[index].first = static_cast<std::uint32_t>(nodes.size());
  nodes[index].count = 0;
  nodes.push_back({{}, first, half});
  nodes.push_back({{}, first + half, count - half});
}

}  // namespace kiln
