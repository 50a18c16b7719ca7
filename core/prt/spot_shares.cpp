#include "core/prt/spot_shares.h"

#include <algorithm>
#include <utility>

#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr int kEmitterSamples = 16;

float distance2_to_box(const Mesh& mesh, const Triangle& t, const Vec3f& p) {
  float sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax({mesh.position[t[0]][axis], mesh.position[t[1]][axis], mesh.position[t[2]][axis]});
    const float away = std::max({low - p[axis], p[axis] - high, 0.0F});
    sum += away * away;
  }
  return sum;
}

Vec3f ratio(const Vec3f& part, const Vec3f& whole) {
  const auto of = [](float a, float b) { return b > 0 ? std::min(1.0F, a / b) : 0; };
  return {of(part.x, whole.x), of(part.y, whole.y), of(part.z, whole.z)};
}

}  // namespace

SpotShares::SpotShares(const BrightSpots& spots, const Lamps& lamps, const Mesh& mesh,
                       const std::function<TransferPoint(std::uint32_t)>& point_of) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> near;  // vertex and lamp
  for (std::uint32_t k = 0; k < spots.lamps().size(); ++k) {
    const auto& [light, reach] = spots.lamps()[k];
    for (const Triangle& t : mesh.triangles) {
      if (distance2_to_box(mesh, t, light->position) > reach * reach) continue;
      for (const std::uint32_t v : t) near.emplace_back(v, k);
    }
  }
  std::ranges::sort(near);
  near.erase(std::unique(near.begin(), near.end()), near.end());
  std::uint64_t rays = 0;
  for (const auto& [v, k] : near) {
    const TransferPoint p = point_of(v);
    const Receiver at{ray_origin(p), p.normal};
    const Vec3f own = lamps.punctual(at, *spots.lamps()[k].light);
    if (own == Vec3f{}) continue;
    const Vec3f all = lamps.punctual(at) + lamps.emitted(at, {.samples = kEmitterSamples}, v, rays);
    shares_.push_back({v, k, ratio(own, all)});
  }
  if (shares_.empty()) return;
  first_.assign(mesh.position.size() + 1, 0);
  for (const Share& s : shares_) ++first_[s.vertex + 1];
  for (std::size_t v = 0; v < mesh.position.size(); ++v) first_[v + 1] += first_[v];
}

}  // namespace kiln
