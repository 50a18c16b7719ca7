#include "core/grid/bake_grid.h"

#include <algorithm>

#include "core/base/expects.h"
#include "core/base/shared_loop.h"
#include "core/grid/cell_corners.h"
#include "core/grid/surface_fit.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 32;

void store(const IrradianceVectors& light, std::size_t vertex, Grid& grid) {
  const auto put = [&](const auto& parts) {
    for (std::size_t k = 0; k < parts.size(); ++k) grid.parts[k][vertex] = parts[k];
  };
  if (grid.blend == GridBlend::exact) put(exact_parts(light));
  if (grid.blend == GridBlend::paper) put(paper_parts(light));
}

/// The neighbours of a vertex in a box of 3 x 3 x 3.
template <class F>
void each_neighbour(const Lattice& lattice, std::size_t vertex, const F& f) {
  const auto [x, y, z] = lattice.vertex(vertex);
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const std::array<int, 3> at{x + dx, y + dy, z + dz};
        bool inside = dx != 0 || dy != 0 || dz != 0;
        for (std::size_t axis = 0; axis < 3; ++axis) inside = inside && at[axis] >= 0 && at[axis] < lattice.size[axis];
        if (inside) f(lattice.index(at));
      }
    }
  }
}

/// Layer by layer from the valid vertices inwards. Does nothing where there are none.
void fill_invalid(Grid& grid, std::vector<char> known) {
  std::vector<std::size_t> left;
  for (std::size_t v = 0; v < known.size(); ++v) {
    if (known[v] == 0) left.push_back(v);
  }
  while (!left.empty()) {
    std::vector<std::size_t> filled, later;
    for (const std::size_t v : left) {
      std::vector<std::size_t> from;
      each_neighbour(grid.lattice, v, [&](std::size_t n) {
        if (known[n] != 0) from.push_back(n);
      });
      (from.empty() ? later : filled).push_back(v);
      for (auto& part : grid.parts) {
        if (from.empty()) break;
        Vec3f sum;
        for (const std::size_t n : from) sum += part[n];
        part[v] = sum / static_cast<float>(from.size());
      }
    }
    if (filled.empty()) return;
    for (const std::size_t v : filled) known[v] = 1;
    left = std::move(later);
  }
}

}  // namespace

Box box_of(const Mesh& mesh) {
  if (mesh.position.empty()) return {};
  Box box{to_double(mesh.position[0]), to_double(mesh.position[0])};
  for (const Vec3f& p : mesh.position) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], double{p[axis]});
      box.high[axis] = std::max(box.high[axis], double{p[axis]});
    }
  }
  return box;
}

std::vector<Vec3f> gather_places(const Lattice& lattice, const Scene& scene, Threads& threads) {
  const ClosestPoint nearest(scene.mesh);
  const double reach = kNearSurface * std::min({lattice.spacing.x, lattice.spacing.y, lattice.spacing.z});
  std::vector<Vec3f> places(lattice.vertices());
  threads.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3d at = lattice.position(lattice.vertex(v));
      places[v] = to_float(at);
      const auto match = nearest.query(at, {}, reach);
      if (!match) continue;
      const Vec3d on = match_position(scene.mesh, *match);
      const Vec3d face = normalized(to_double(area_vector(scene.mesh, scene.mesh.triangles[match->triangle])));
      const Part& part = scene.parts[scene.mesh.part[match->triangle]];
      const bool flip = scene.materials[static_cast<std::size_t>(part.material)].double_sided && dot(at - on, face) < 0;
      places[v] = to_float(on + (flip ? -face : face) * reach);
    }
  });
  return places;
}

BakedGrid bake_grid(const SphereGather::World& world, const GridBake& params, Threads& threads) {
  const auto [nx, ny, nz] = params.size;
  EXPECTS(nx >= 1 && ny >= 1 && nz >= 1 && params.rays >= 1);
  const Scene& scene = world.tracer.scene();
  const Box box = box_of(scene.mesh);
  BakedGrid out;
  Grid& grid = out.grid;
  grid.lattice = lattice_over(box.low, box.high, params.size);
  grid.blend = params.blend;
  grid.content = params.content;
  grid.parts.assign(part_count(params.blend), std::vector<Vec3f>(grid.lattice.vertices()));

  const std::vector<Vec3f> places = gather_places(grid.lattice, scene, threads);
  const SphereGather gather(world, params.content, params.rays, params.seed);
  std::vector<char> valid(places.size());
  BlockCounts rays(places.size(), kBlock);
  run_loop({.name = "grid vertices",
            .items = places.size(),
            .block = kBlock,
            .body =
                [&](std::size_t begin, std::size_t end) {
                  std::uint64_t own = 0;
                  for (std::size_t v = begin; v < end; ++v) {
                    const GatheredLight light = gather.at(places[v], v, own);
                    valid[v] = light.back <= kBackShare ? 1 : 0;
                    store(light.light, v, grid);
                  }
                  rays.at(begin) = own;
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  for (auto& part : grid.parts) stream.pass(std::span(part).subspan(begin, end - begin));
                  stream.pass(std::span(valid).subspan(begin, end - begin));
                  rays.pass(begin, end, stream);
                },
            .progress = params.progress},
           threads);
  fill_invalid(grid, valid);
  out.stats.invalid = static_cast<std::size_t>(std::count(valid.begin(), valid.end(), 0));
  for (std::size_t v = 0; v < places.size(); ++v) {
    if (places[v] != to_float(grid.lattice.position(grid.lattice.vertex(v)))) ++out.stats.moved;
  }
  out.stats.rays = rays.sum();
  if (params.corners) grid.cells = find_cell_corners(world.tracer, grid.lattice, places, out.stats.rays, threads);
  if (fits_surface(params)) {
    const SurfacePlaces surface{.rays = params.rays / 2, .seed = params.seed};
    fit_to_surface(gather_surface(world, surface, grid, places, out.stats.rays, threads), grid, threads);
  }
  return out;
}

}  // namespace kiln
