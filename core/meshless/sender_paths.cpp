#include "core/meshless/sender_paths.h"

#include <algorithm>

#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr int kMostStrictSteps = 4;

}  // namespace

SenderPaths::End SenderPaths::follow(Hit hit, Vec3f direction, bool enclosed, Random& random,
                                     std::uint64_t& rays) const {
  const Mesh& mesh = world_.tracer.scene().mesh;
  End end;
  for (int step = 0; !world_.strict || step < kMostStrictSteps; ++step) {
    const HitSide side = world_.faces.side(hit.triangle, direction);
    if (side == HitSide::dark) return end;
    if (world_.faces.is_plain(hit.triangle)) {
      end.throughput = end.throughput * world_.faces.plain(mesh.part[hit.triangle]);
    } else {
      const auto draw = static_cast<std::uint32_t>(random.next());
      end.throughput = end.throughput * world_.albedo.read(world_.albedo.tap(hit.triangle, hit.u, hit.v, draw));
    }
    const float most = std::max({end.throughput.x, end.throughput.y, end.throughput.z});
    if (!(most > 0)) return end;
    std::uint32_t sender = Senders::kNone;
    sender = side == HitSide::front ? world_.senders.at(hit.triangle, hit.u, hit.v)
                                    : world_.senders.behind(hit.triangle, hit.u, hit.v);
    if (sender != Senders::kNone && !enclosed && !world_.strict) {
      end.sender = sender;
      return end;
    }

    const Triangle& t = mesh.triangles[hit.triangle];
    Vec3f up = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
    if (dot(up, direction) > 0) up = -up;
    const Vec3f place =
        mesh.position[t[0]] * (1 - hit.u - hit.v) + mesh.position[t[1]] * hit.u + mesh.position[t[2]] * hit.v;
    const Vec3f origin = offset_origin(place, up);
    if (sender != Senders::kNone) {
      if (world_.strict) {
        sender = seen_sender({place, up, world_.senders.site(sender).group}, sender);
      } else if (!sees(sender, origin)) {
        sender = Senders::kNone;
      }
      if (sender != Senders::kNone) {
        end.sender = sender;
        return end;
      }
    }

    // No sender stands for this place: light it, and go on in a random direction while the throughput lasts.
    if (world_.light != nullptr) end.picked_up += end.throughput * world_.light->at({origin, up}, random.next(), rays);
    const float alive = std::min(1.0F, most);
    if (random.uniform() >= alive) return end;
    end.throughput = end.throughput / alive;
    const float x = random.uniform(), y = random.uniform();
    direction = normalized(basis_around(up).to_world(cosine_hemisphere(Vec2f{x, y})), up);
    hit = world_.tracer.closest(origin, direction, kFar);
    ++rays;
    if (!hit) return end;
  }
  end.sender = Senders::kNone;
  return end;
}

/// Whether nothing stands between a place and its sender.
bool SenderPaths::sees(std::uint32_t sender, const Vec3f& origin) const {
  const Vec3f way = world_.senders.origin(sender) - origin;
  const float distance = length(way);
  return !(distance > 0) || !world_.tracer.occluded(origin, way / distance, distance);
}

std::uint32_t SenderPaths::seen_sender(const SurfaceSite& place, std::uint32_t first) const {
  const auto seen = [&](std::uint32_t sender) { return in_sight(world_.tracer, place, world_.senders.site(sender)); };
  if (first != Senders::kNone && seen(first)) return first;
  return world_.senders.nearest(place, seen);
}

bool in_sight(const Tracer& tracer, const SurfaceSite& a, const SurfaceSite& b) {
  constexpr float kRise = 0.25F;  // of the distance: clears any ball of more than half its radius
  const auto open = [&](const Vec3f& from, const Vec3f& to) {
    const Vec3f way = to - from;
    const float distance = length(way);
    return !(distance > 0) || !tracer.occluded(from, way / distance, distance);
  };
  const Vec3f low_a = offset_origin(a.position, a.normal), low_b = offset_origin(b.position, b.normal);
  if (open(low_a, low_b)) return true;
  const float rise = kRise * length(b.position - a.position);
  const Vec3f high_a = low_a + a.normal * rise, high_b = low_b + b.normal * rise;
  return open(high_a, high_b) && open(low_a, high_a) && open(low_b, high_b);
}

}  // namespace kiln
