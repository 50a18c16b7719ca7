#include "core/mesh/pieces.h"

#include <algorithm>

#include "core/mesh/topology.h"

namespace kiln {
namespace {

/// Sets of vertices, each named by its lowest.
class Sets {
 public:
  explicit Sets(std::vector<std::uint32_t> first) : parent_(std::move(first)) {}
  std::uint32_t of(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t first = of(a), second = of(b);
    parent_[std::max(first, second)] = std::min(first, second);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

struct Box {
  Vec3f low, high;
  bool empty = true;
  void hold(const Vec3f& p) {
    if (empty) low = high = p, empty = false;
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  }
};

}  // namespace

std::vector<float> piece_diagonals(const Mesh& mesh) {
  Sets pieces(weld_by_position(mesh.position));
  for (const Triangle& t : mesh.triangles) pieces.join(t[0], t[1]), pieces.join(t[0], t[2]);
  std::vector<Box> box(mesh.position.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) box[pieces.of(v)].hold(mesh.position[v]);
  std::vector<float> out(mesh.position.size());
  for (std::uint32_t v = 0; v < out.size(); ++v) {
    const Box& b = box[pieces.of(v)];
    out[v] = length(b.high - b.low);
  }
  return out;
}

}  // namespace kiln
