#pragma once
// An irradiance vector grid of a scene, gathered at every vertex of a lattice.
//
// Place    A vertex within kNearSurface spacings of a surface gathers that far off it (on the front of a single-sided
//          face): on the very wall it would look through it.
// Invalid  A vertex of which more than kBackShare of the rays meet backs of single-sided faces is inside a solid. It
// gets
//          the mean of its valid neighbours, then theirs; corners that count never name it, readers without them do.
// Corners  core/grid/cell_corners.h
// Fit      Reflected light in the exact blend is fitted to what places of the surface receive, by half as many rays
// each
//          (core/grid/surface_fit.h). Lamps' own light falls off within a cell: there what stands in the open counts.
// Paper    Pacanowski et al. 2006, section 3.   Differs  blend and corners (irradiance_vectors.h, grid.h)
// Cost     rays x vertices closest hits, and a read of a table for each
// Error    see README.md.   Repeat  same bits for any thread count.   Fails  never on a valid Scene; Cancelled if
// stopped

#include <cstdint>
#include <functional>

#include "core/base/threads.h"
#include "core/grid/grid.h"
#include "core/grid/sphere_gather.h"

namespace kiln {

struct GridBake {
  std::array<int, 3> size{16, 16, 16};
  GridBlend blend = GridBlend::exact;
  GridContent content = GridContent::indirect;
  int rays = 512;       // of a vertex
  bool corners = true;  // find which corners count
  std::uint64_t seed = 0;
  std::function<void(std::uint64_t done, std::uint64_t total)> progress =
      {};  // vertices; from any thread, one call at a time
};

/// Whether a bake with these parameters is fitted to the surface.
inline bool fits_surface(const GridBake& params) {
  return params.corners && params.blend == GridBlend::exact && params.content == GridContent::indirect;
}

struct GridStats {
  std::uint64_t rays = 0;
  std::size_t invalid = 0, moved = 0;  // vertices
};

struct BakedGrid {
  Grid grid;  // in unit-cube lengths
  GridStats stats;
};

inline constexpr float kBackShare = 0.15F;
inline constexpr double kNearSurface = 0.05;

BakedGrid bake_grid(const SphereGather::World&, const GridBake&, Threads&);

/// Where each vertex of a lattice gathers, in the unit cube.
std::vector<Vec3f> gather_places(const Lattice&, const Scene&, Threads&);

/// The box of a mesh; a point at the origin when it is empty.
struct Box {
  Vec3d low, high;
};
Box box_of(const Mesh&);

}  // namespace kiln
