#include "core/mesh/topology.h"

#include <bit>
#include <unordered_map>

#include "core/base/random.h"

namespace kiln {
namespace {

struct PositionKey {
  std::array<std::uint32_t, 3> bits;
  friend bool operator==(const PositionKey&, const PositionKey&) = default;
};

struct PositionHash {
  std::size_t operator()(const PositionKey& key) const {
    return mix64(mix64(key.bits[0]) ^ (std::uint64_t{key.bits[1]} << 32 | key.bits[2]));
  }
};

PositionKey key_of(const Vec3f& p) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x == 0.0F ? 0.0F : x); };
  return {{bits(p.x), bits(p.y), bits(p.z)}};
}

}  // namespace

std::vector<std::uint32_t> weld_by_position(const std::vector<Vec3f>& position) {
  std::unordered_map<PositionKey, std::uint32_t, PositionHash> first;
  first.reserve(position.size());
  std::vector<std::uint32_t> weld(position.size());
  for (std::uint32_t v = 0; v < position.size(); ++v) weld[v] = first.try_emplace(key_of(position[v]), v).first->second;
  return weld;
}

Vec3f area_vector(const Mesh& mesh, const Triangle& t) {
  return cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]);
}

double triangle_area(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = to_double(mesh.position[t[0]]);
  return 0.5 * length(cross(to_double(mesh.position[t[1]]) - a, to_double(mesh.position[t[2]]) - a));
}

double surface_area(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += triangle_area(mesh, t);
  return sum;
}

}  // namespace kiln
