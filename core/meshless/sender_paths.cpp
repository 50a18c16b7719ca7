#include "core/meshless/sender_paths.h"

#include <algorithm>

#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
SenderPaths::End SenderPaths::follow(Hit hit, Vec3f direction, Random& random, std::uint64_t& rays, bool alone) const {
  const Mesh& mesh = world_.tracer.scene().mesh;
  End end;
  for (int step = 0; step < kMostSteps; ++step) {
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
    if (step > 0 || !alone)
      end.sender = side == HitSide::front ? world_.senders.at(hit.triangle, hit.u, hit.v)
                                          : world_.senders.behind(hit.triangle, hit.u, hit.v);
    if (end.sender != Senders::kNone) return end;

    const Triangle& t = mesh.triangles[hit.triangle];
    Vec3f up = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
    if (dot(up, direction) > 0) up = -up;
    const Vec3f place =
        mesh.position[t[0]] * (1 - hit.u - hit.v) + mesh.position[t[1]] * hit.u + mesh.position[t[2]] * hit.v;
    const Vec3f origin = offset_origin(place, up);
    // No sender: light the place, and go on in a random direction while the throughput lasts.
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
  return end;
}

}  // namespace kiln
