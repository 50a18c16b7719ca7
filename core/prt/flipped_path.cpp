#include "core/prt/flipped_path.h"

#include <array>

#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

void add_sky(const Vec3f& direction, const Vec3f& throughput, const PathSum& sum) {
  std::array<float, sh_count(kMaxShOrder)> y;
  evaluate_sh(sum.order, direction, y.data());
  const auto count = static_cast<std::size_t>(sh_count(sum.order));
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < count; ++i) sum.rows[c * count + i] += throughput[c] * y[i];
  }
}

bool is_dark_back(const Scene& scene, const SurfacePoint& p, const Vec3f& direction) {
  const auto material = static_cast<std::size_t>(scene.parts[scene.mesh.part[p.triangle]].material);
  return dot(p.geometric_normal, direction) > 0 && !scene.materials[material].double_sided;
}

}  // namespace

int add_flipped_path(const Tracer& tracer, const Lamps& lamps, FlippedHit hit, Random& random, const PathSum& sum) {
  const Scene& scene = tracer.scene();
  Vec3f throughput{1, 1, 1};
  for (int rays = 0;; --hit.reflections) {
    const SurfacePoint p = surface_point(scene, hit.triangle, hit.u, hit.v);
    if (is_dark_back(scene, p, hit.direction)) return rays;
    throughput = throughput * albedo_at(scene, p);
    const Vec3f up = dot(p.geometric_normal, hit.direction) > 0 ? -p.geometric_normal : p.geometric_normal;
    const Receiver receiver{offset_origin(p.position, up), up};
    if (sum.fixed != nullptr) *sum.fixed += throughput * lamps.punctual(receiver);

    const float x = random.uniform(), y = random.uniform();
    const Vec3f w = basis_around(up).to_world(cosine_hemisphere(Vec2f{x, y}));
    const Hit next = tracer.closest(receiver.origin, w, kFar);
    ++rays;
    if (!next) {
      add_sky(w, throughput, sum);
      return rays;
    }
    if (sum.fixed != nullptr) *sum.fixed += throughput * lamps.emission(next.triangle, next.u, next.v, w);
    if (hit.reflections == 0) return rays;
    hit = {next.triangle, next.u, next.v, w, hit.reflections};
  }
}

}  // namespace kiln
