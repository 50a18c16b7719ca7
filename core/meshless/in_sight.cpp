#include "core/meshless/in_sight.h"

#include <array>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr float kRise = 0.25F;  // of the distance: clears any ball of more than half its radius

bool is_open(const Tracer& tracer, const Vec3f& from, const Vec3f& to) {
  const Vec3f way = to - from;
  const float distance = length(way);
  return !(distance > 0) || !tracer.occluded(from, way / distance, distance);
}

/// Bit i: nothing stands between `from` and to[i].
std::uint32_t open_straight(const Tracer& tracer, const Vec3f& from, std::span<const Vec3f> to) {
  constexpr std::size_t kFew = 3;  // that one by one are faster than as a packet
  std::uint32_t open = 0;
  if (to.size() <= kFew) {
    for (std::size_t i = 0; i < to.size(); ++i) open |= is_open(tracer, from, to[i]) ? 1U << i : 0;
    return open;
  }
  Rays16 rays;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const Vec3f way = to[i] - from;
    const float distance = length(way);
    const Vec3f w = distance > 0 ? way / distance : Vec3f{0, 0, 1};
    rays.ox[i] = from.x, rays.oy[i] = from.y, rays.oz[i] = from.z;
    rays.dx[i] = w.x, rays.dy[i] = w.y, rays.dz[i] = w.z;
    rays.far[i] = distance;
  }
  return ~tracer.occluded16(rays, static_cast<int>(to.size())) & ((1U << to.size()) - 1);
}

}  // namespace

std::uint32_t in_sight(const Tracer& tracer, const SurfaceSite& from, std::span<const SurfaceSite> to) {
  EXPECTS(to.size() <= kPacket);
  const Vec3f low = offset_origin(from.position, from.normal);
  std::array<Vec3f, kPacket> low_to;
  for (std::size_t i = 0; i < to.size(); ++i) low_to[i] = offset_origin(to[i].position, to[i].normal);
  std::uint32_t seen = open_straight(tracer, low, std::span(low_to).first(to.size()));
  for (std::size_t i = 0; i < to.size(); ++i) {
    if ((seen >> i & 1) != 0) continue;
    const float rise = kRise * length(to[i].position - from.position);
    const Vec3f high = low + from.normal * rise, high_to = low_to[i] + to[i].normal * rise;
    if (is_open(tracer, high, high_to) && is_open(tracer, low, high) && is_open(tracer, low_to[i], high_to)) {
      seen |= 1U << i;
    }
  }
  return seen;
}

}  // namespace kiln
