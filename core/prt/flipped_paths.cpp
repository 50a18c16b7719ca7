#include "core/prt/flipped_paths.h"

#include <algorithm>

#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"

namespace kiln {

FlippedPaths::FlippedPaths(const Tracer& tracer, const Lamps& lamps, const HitAlbedo& albedo, int order, bool lit,
                           const BrightSpots* spots)
    : tracer_(tracer),
      lamps_(lamps),
      albedo_(albedo),
      order_(order),
      lit_(lit),
      spots_(spots),
      rows_(static_cast<std::size_t>(3 * sh_count(order))) {}

void FlippedPaths::clear() {
  std::fill(rows_.begin(), rows_.end(), 0.0F);
  fixed_ = {};
}

void FlippedPaths::add(const FlippedHit& hit, Random& random) {
  const Scene& scene = tracer_.scene();
  const Mesh& mesh = scene.mesh;
  const Triangle& t = mesh.triangles[hit.triangle];
  const Vec3f face = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
  const bool behind = dot(face, hit.direction) > 0;
  const auto material = static_cast<std::size_t>(scene.parts[mesh.part[hit.triangle]].material);
  if (behind && !scene.materials[material].double_sided) return;

  const Vec3f up = behind ? -face : face;
  const Vec3f position =
      mesh.position[t[0]] * (1 - hit.u - hit.v) + mesh.position[t[1]] * hit.u + mesh.position[t[2]] * hit.v;
  const auto draw = static_cast<std::uint32_t>(random.next());
  const Vec3f throughput = hit.throughput * albedo_.read(albedo_.tap(hit.triangle, hit.u, hit.v, draw));
  if (throughput == Vec3f{}) return;
  waiting_[static_cast<std::size_t>(count_++)] = {offset_origin(position, up), up, throughput, hit.reflections, hit.by};
  if (count_ == kPacket) trace_waiting(random);
}

void FlippedPaths::finish(Random& random) {
  while (count_ > 0) trace_waiting(random);
}

Vec3f FlippedPaths::lamp_light(const Step& s) const {
  const Receiver at{s.origin, s.normal};
  return spots_ != nullptr && s.by.rays > 0 ? spots_->gathered(lamps_, at, s.by) : lamps_.punctual(at);
}

void FlippedPaths::trace_waiting(Random& random) {
  const std::array<Step, kPacket> steps = waiting_;
  const int count = count_;
  count_ = 0;
  Rays16 rays{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const Step& s = steps[i];
    if (lit_) fixed_ += s.throughput * lamp_light(s);
    const float x = random.uniform(), y = random.uniform();
    const Vec3f w = basis_around(s.normal).to_world(cosine_hemisphere(Vec2f{x, y}));
    rays.ox[i] = s.origin.x, rays.oy[i] = s.origin.y, rays.oz[i] = s.origin.z;
    rays.dx[i] = w.x, rays.dy[i] = w.y, rays.dz[i] = w.z;
    rays.far[i] = kFar;
  }
  Hits16 hits;
  tracer_.closest16(rays, hits, count);
  rays_ += static_cast<std::uint64_t>(count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const Vec3f w{rays.dx[i], rays.dy[i], rays.dz[i]};
    if (hits.triangle[i] == kNoHit) {
      add_sky(w, steps[i].throughput);
      continue;
    }
    if (lit_) fixed_ += steps[i].throughput * lamps_.emission(hits.triangle[i], hits.u[i], hits.v[i], w);
    // At most as many paths wait as have just left: there is room.
    if (steps[i].reflections > 0) {
      add({hits.triangle[i], hits.u[i], hits.v[i], w, steps[i].throughput, steps[i].reflections - 1}, random);
    }
  }
}

void FlippedPaths::add_sky(const Vec3f& direction, const Vec3f& throughput) {
  std::array<float, sh_count(kMaxShOrder)> y;
  evaluate_sh(order_, direction, y.data());
  const auto count = static_cast<std::size_t>(sh_count(order_));
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < count; ++i) rows_[c * count + i] += throughput[c] * y[i];
  }
}

}  // namespace kiln
