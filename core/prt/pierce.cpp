#include "core/prt/pierce.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr float kEnds = 1.0F / 64, kThick = 1.0F / 8;  // of an edge
constexpr float kStands = 1e-4F;                       // unit cube

std::optional<Pierced> find_pierced(const Tracer& tracer, const TransferPoint& a, const TransferPoint& b) {
  const Vec3f start = ray_origin(a), end = ray_origin(b);
  const float way = length(end - start);
  if (!(way > 0)) return std::nullopt;
  const Vec3f along = (end - start) / way;
  const Hit there = tracer.closest(start, along, way);
  if (!there) return std::nullopt;
  const Hit back = tracer.closest(end, -along, way);
  if (!back || !tracer.occluded(start + a.normal * kStands, along, way)) return std::nullopt;
  return Pierced{std::clamp(there.t / way, 0.0F, 1.0F), 1 - std::clamp(back.t / way, 0.0F, 1.0F)};
}

/// Where an edge of a triangle is pierced between its ends.
std::optional<Pierced> pierced_edge(const Mesh& mesh, const Triangle& t, std::uint32_t a, std::uint32_t b,
                                    const PierceTest& test) {
  const float edge = length(mesh.position[b] - mesh.position[a]);
  const float margin = std::max(kEnds, edge > 0 ? kClear / edge : 1.0F);
  if (margin > 0.25F) return std::nullopt;
  const auto found = test(between(mesh, t, a, b, margin), between(mesh, t, a, b, 1 - margin));
  if (!found) return std::nullopt;
  const auto whole = [&](float share) { return margin + (1 - 2 * margin) * share; };
  return Pierced{whole(found->from_a), whole(found->from_b)};
}

bool can_be_cut(const Pierced& p) { return p.from_b - p.from_a < kThick; }

/// Whether the line through two edges of a triangle, met at these shares of them from their common corner, is met
/// halfway between as well.
bool is_straight(const Mesh& mesh, const Triangle& t, std::size_t corner, float on_next, float on_before,
                 const PierceTest& test) {
  constexpr float kOff = 1.0F / 16;
  const Vec3f at = mesh.position[t[corner]];
  const Vec3f middle = (mesh.position[t[(corner + 1) % 3]] - at) * (0.5F * on_next) +
                       (mesh.position[t[(corner + 2) % 3]] - at) * (0.5F * on_before);
  const float share = 0.5F * (on_next + on_before);  // of the way through the middle to the third edge
  TransferPoint near = between(mesh, t, t[corner], t[corner], 0), far = near;
  near.position = at + middle * (kEnds / share);
  far.position = at + middle * ((1 - kEnds) / share);
  const auto found = test(near, far);
  return found && std::abs(kEnds + (1 - 2 * kEnds) * found->middle() - share) < kOff;
}

}  // namespace

PierceTest pierce_test(const Tracer& tracer) {
  return [&tracer](const TransferPoint& a, const TransferPoint& b) { return find_pierced(tracer, a, b); };
}

TransferPoint between(const Mesh& mesh, const Triangle& triangle, std::uint32_t a, std::uint32_t b, float share) {
  const Vec3f normal = normalized(mesh.normal[a] * (1 - share) + mesh.normal[b] * share, mesh.normal[a]);
  return {.position = mesh.position[a] + (mesh.position[b] - mesh.position[a]) * share,
          .normal = normal,
          .inward = centroid(mesh, triangle),
          .face_normal = normalized(area_vector(mesh, triangle), normal)};
}

std::optional<Pierced> cut_of_edge(const Mesh& mesh, const Triangle& t, std::uint32_t a, std::uint32_t b,
                                   const PierceTest& test) {
  const auto found = pierced_edge(mesh, t, a, b, test);
  return found && can_be_cut(*found) ? found : std::nullopt;
}

PiercedTriangle pierced_triangle(const Mesh& mesh, const Triangle& t, const PierceTest& test) {
  std::array<std::optional<Pierced>, 3> edge;  // edge k from corner k to the next
  std::size_t pierced = 0;
  PiercedTriangle out;
  for (std::size_t k = 0; k < 3; ++k) {
    edge[k] = pierced_edge(mesh, t, t[k], t[(k + 1) % 3], test);
    if (!edge[k]) continue;
    ++pierced;
    if (can_be_cut(*edge[k])) ++out.cuts;
  }
  if (out.cuts == 2 && pierced == 2) {
    const std::size_t apart = !edge[0] ? 2 : !edge[1] ? 0 : 1;  // the corner of both edges
    const Pierced &next = *edge[apart], &before = *edge[(apart + 2) % 3];
    out.straight = is_straight(mesh, t, apart, next.middle(), 1 - before.middle(), test);
  }
  return out;
}

}  // namespace kiln
