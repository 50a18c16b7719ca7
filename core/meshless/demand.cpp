#include "core/meshless/demand.h"

#include <algorithm>

#include "core/base/random.h"
#include "core/meshless/cover.h"
#include "core/meshless/in_sight.h"
#include "core/meshless/point_grid.h"
#include "core/prt/direction_sets.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128;

using Asked = std::vector<MeshlessPoint>;

/// Joined in order: the same for any thread count.
template <class F>
Asked collect(std::size_t count, Threads& threads, const F& ask) {
  std::vector<Asked> found((count + kBlock - 1) / kBlock);
  threads.for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ask(i, found[begin / kBlock]);
  });
  Asked out;
  for (const Asked& own : found) out.insert(out.end(), own.begin(), own.end());
  return out;
}

Asked asked_by_readers(const Demand& demand, const Senders& senders, float cover, Threads& threads) {
  return collect(demand.readers.size(), threads, [&](std::size_t i, Asked& out) {
    const SurfaceSite site = reader_site(demand.tracer, demand.readers[i], cover);
    if (senders.nearest(site) != Senders::kNone) return;
    out.push_back({.site = site, .face_normal = demand.readers[i].face_normal, .triangle = kNoFace});
  });
}

/// What the rays of points `first` and on meet.
Asked asked_by_rays(const Demand& demand, const PointHierarchy& points, const Senders& senders, std::size_t first,
                    Threads& threads) {
  const std::uint64_t seed = mix64(demand.seed ^ 0x64656d616e64ULL);
  const DirectionSets sets(0, kDemandRays, 64, seed);
  return collect(points.points.size() - first, threads, [&](std::size_t i, Asked& out) {
    const TransferPoint from = transfer_point(points.points[first + i]);
    const LocalFrame frame = local_frame(sets, from.normal, seed, point_key(from));
    const Vec3f origin = ray_origin(from);
    Rays16 rays;
    Hits16 hits;
    rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
    sets.turn(frame.set, 0, frame.basis, rays);
    demand.tracer.closest16(rays, hits);
    for (std::size_t k = 0; k < kPacket; ++k) {
      const std::uint32_t triangle = hits.triangle[k];
      if (triangle == kNoHit) continue;
      const HitSide side = demand.faces.side(triangle, {rays.dx[k], rays.dy[k], rays.dz[k]});
      if (side == HitSide::dark) continue;
      const float u = hits.u[k], v = hits.v[k];
      const bool back = side == HitSide::flipped;
      if ((back ? senders.behind(triangle, u, v) : senders.at(triangle, u, v)) != Senders::kNone) continue;
      MeshlessPoint& p = out.emplace_back(point_on(demand.tracer.scene(), triangle, {u, v}, back));
      p.site.group = group_of(demand.tracer, transfer_point(p), points.cover);
    }
  });
}

}  // namespace

SurfaceSite reader_site(const Tracer& tracer, const TransferPoint& p, float cover) {
  return {inside_face(p, cover), p.normal, group_of(tracer, p, cover)};
}

void add_demanded(const Demand& demand, PointHierarchy& points, Senders& senders, Threads& threads) {
  if (points.points.empty()) return;
  const std::size_t placed = points.points.size(), most = demand.most > 0 ? demand.most : 2 * placed;
  const float radius = points.radius.back();
  std::size_t first = 0;  // whose rays ask
  for (int round = 0; round < kDemandRounds; ++round) {
    Asked asked = round == 0 ? asked_by_readers(demand, senders, points.cover, threads) : Asked{};
    const Asked met = asked_by_rays(demand, points, senders, first, threads);
    asked.insert(asked.begin(), met.begin(), met.end());
    first = points.points.size();
    PointGrid grid(2 * radius);
    for (MeshlessPoint& p : asked) {
      const float reach = p.triangle == kNoFace ? Senders::kReach * radius : radius;
      if (points.points.size() >= most) break;
      threads.check();
      bool known = false;
      grid.near(p.site.position, reach, [&](std::uint32_t i, float d2) {
        const SurfaceSite& q = points.points[i].site;
        const float cosine = dot(q.normal, p.site.normal);
        known = known || (q.group == p.site.group && cosine > 0 && d2 <= reach * reach * cosine * cosine &&
                          in_sight(demand.tracer, p.site, q));
      });
      if (known) continue;
      p.pocket = is_enclosed(demand.tracer, demand.faces, transfer_point(p));
      grid.add(static_cast<std::uint32_t>(points.points.size()), p.site.position);
      points.points.push_back(p);
    }
    if (points.points.size() == first) break;
    senders.add_new(threads);
  }
  if (points.points.size() == placed) return;
  points.level_end.push_back(static_cast<std::uint32_t>(points.points.size()));
  points.radius.push_back(radius);
  points.demanded = true;
}

}  // namespace kiln
