#include "core/prt/ray_origin.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/random.h"
#include "core/prt/morton.h"
#include "core/trace/tracer.h"

namespace kiln {
namespace {

constexpr float kPull = 2e-6F;       // of the unit cube: about the lift of offset_origin; at half of it the tracer's
                                     // rounding lets twice as many rays through the seams of a closed room
constexpr float kSteepest = 0.25F;   // below this cosine between shading and face normal the face lends its own
constexpr float kMostAside = 0.35F;  // of the lift: a third of the pull, which must win where a wall stands

// The lift: along the shading normal, bent away from a face that it nearly grazes, and hardly along the face.
Vec3f lift_direction(const TransferPoint& p) {
  const float cosine = dot(p.normal, p.face_normal);
  const Vec3f bent = p.normal + p.face_normal * std::copysign(1.0F, cosine);
  const Vec3f lift = std::abs(cosine) >= kSteepest ? p.normal : normalized(bent, p.normal);
  const Vec3f up = p.face_normal * dot(lift, p.face_normal), aside = lift - up;
  const float size = length(aside);
  return size > kMostAside ? up + aside * (kMostAside / size) : lift;
}

}  // namespace

Vec3f ray_origin(const TransferPoint& p) {
  const Vec3f inward = p.inward - p.position;
  const float distance = length(inward);
  const Vec3f pulled = distance > 0 ? p.position + inward * (std::min(kPull, 0.5F * distance) / distance) : p.position;
  return offset_origin(pulled, lift_direction(p));
}

std::uint64_t point_key(const TransferPoint& p) {
  std::uint64_t key = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    key = mix64(key ^ (std::uint64_t{std::bit_cast<std::uint32_t>(p.position[i] + 0.0F)} << 32 |
                       std::bit_cast<std::uint32_t>(p.normal[i] + 0.0F)));
  }
  return key;
}

std::vector<std::uint32_t> morton_order_of(std::span<const TransferPoint> points) {
  std::vector<Vec3f> positions(points.size());
  std::transform(points.begin(), points.end(), positions.begin(), [](const TransferPoint& p) { return p.position; });
  return morton_order(positions);
}

}  // namespace kiln
