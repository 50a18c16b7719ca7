#include "core/meshless/cover.h"

#include <algorithm>

namespace kiln {
namespace {

constexpr float kInside = 0.05F;  // of R

}  // namespace

Vec3f inside_face(const TransferPoint& p, float cover) {
  const Vec3f way = p.inward - p.position;
  const float far = length(way);
  return far > 0 ? p.position + way * std::min(1.0F, kInside * cover / far) : p.position;
}

std::uint32_t group_of(const Tracer& tracer, const TransferPoint& p, float cover) {
  const Vec3f origin = offset_origin(inside_face(p, cover), p.face_normal);
  return cover > 0 && tracer.occluded(origin, p.face_normal, cover) ? kCoveredGroup : kOpenGroup;
}

}  // namespace kiln
