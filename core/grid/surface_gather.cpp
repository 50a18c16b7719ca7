#include "core/grid/surface_gather.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/shared_loop.h"
#include "core/grid/cell_corners.h"
#include "core/mesh/topology.h"
#include "core/meshless/points.h"
#include "core/prt/ray_origin.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr int kSets = 8;
constexpr std::size_t kBlock = 256;

bool is_double_sided(const Scene& scene, std::uint32_t triangle) {
  return scene.materials[static_cast<std::size_t>(scene.parts[scene.mesh.part[triangle]].material)].double_sided;
}

/// Places of one sample of the surface.
struct Gathering {
  const SphereGather::World& world;
  const Grid& grid;
  const std::vector<Vec3f>& stands;
  const SurfaceGather gather;

  void add(const SurfacePoint& p, std::uint64_t item, std::vector<SurfacePlace>& out, std::uint64_t& rays) const {
    rays += 9;
    if (is_enclosed(world.tracer, world.faces, {p.position, p.normal, p.position, p.geometric_normal})) return;
    const CornersRead read = corners_read(grid, to_double(p.position), p.normal, GridPlace::surface);
    const Vec3f origin = offset_origin(p.position, p.geometric_normal);
    if ((corners_seen(world.tracer, grid.lattice, stands, read.place, origin) & read.bits) == 0) return;
    out.push_back({p.position, p.normal, gather.at({origin, p.normal}, item, rays)});
  }
};

}  // namespace

SurfaceGather::SurfaceGather(const SphereGather::World& world, int rays, std::uint64_t seed)
    : world_(world), seed_(mix64(seed ^ 0x73757266616365ULL)), sets_(0, rays, kSets, seed_) {}

Vec3f SurfaceGather::at(const Receiver& place, std::uint64_t item, std::uint64_t& rays) const {
  if (world_.surface == nullptr) return {};
  const LocalFrame frame = local_frame(sets_, place.normal, seed_, item);
  Random random(seed_, item, 1);
  Rays16 packet;
  Hits16 hits;
  packet.ox.fill(place.origin.x), packet.oy.fill(place.origin.y), packet.oz.fill(place.origin.z);
  packet.far.fill(kFar);
  Vec3f sum;
  for (int k = 0; k < sets_.samples() / kPacket; ++k) {
    sets_.turn(frame.set, k, frame.basis, packet);
    world_.tracer.closest16(packet, hits);
    for (const std::uint32_t triangle : hits.triangle) {
      if (triangle != kNoHit) world_.surface->prefetch(triangle);
    }
    for (std::size_t i = 0; i < kPacket; ++i) {
      const Hit hit{hits.t[i], hits.u[i], hits.v[i], hits.triangle[i], false};
      if (!hit) continue;
      sum += world_.surface->reflected(hit, {packet.dx[i], packet.dy[i], packet.dz[i]}, random, rays).light;
    }
  }
  rays += static_cast<std::uint64_t>(sets_.samples());
  return sum * (std::numbers::pi_v<float> / static_cast<float>(sets_.samples()));
}

std::vector<SurfacePlace> gather_surface(const SphereGather::World& world, const SurfacePlaces& params,
                                         const Grid& grid, const std::vector<Vec3f>& stands, std::uint64_t& rays,
                                         Threads& threads) {
  const Scene& scene = world.tracer.scene();
  const auto count =
      static_cast<std::size_t>(std::ceil(params.per_face * surface_area(scene.mesh) / smallest_face(grid.lattice)));
  const std::vector<SurfaceSample> samples = sample_surface(scene.mesh, count, mix64(params.seed ^ 0x666974ULL));
  const Gathering gathering{world, grid, stands, {world, params.rays, params.seed}};
  struct Found {
    std::vector<SurfacePlace> places;
    std::uint64_t rays = 0;
  };
  std::vector<Found> found((samples.size() + kBlock - 1) / kBlock);
  run_loop({.name = "places on the surface",
            .items = samples.size(),
            .block = kBlock,
            .body =
                [&](std::size_t begin, std::size_t end) {
                  Found& own = found[begin / kBlock];
                  for (std::size_t i = begin; i < end; ++i) {
                    SurfacePoint p = surface_point(scene, samples[i].triangle, samples[i].u, samples[i].v);
                    gathering.add(p, 2 * i, own.places, own.rays);
                    if (!is_double_sided(scene, p.triangle)) continue;
                    p.normal = -p.normal, p.geometric_normal = -p.geometric_normal;
                    gathering.add(p, 2 * i + 1, own.places, own.rays);
                  }
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  for (std::size_t i = begin; i < end; i += kBlock) {
                    stream.pass(found[i / kBlock].places);
                    stream.pass(found[i / kBlock].rays);
                  }
                }},
           threads);
  std::vector<SurfacePlace> out;
  for (const Found& own : found) {
    out.insert(out.end(), own.places.begin(), own.places.end());
    rays += own.rays;
  }
  return out;
}

}  // namespace kiln
