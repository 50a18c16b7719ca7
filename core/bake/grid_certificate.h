#pragma once
// A grid checks itself: irradiance / pi at random points of the surface, read from the decoded file, against the
// path-traced reference of the same light (reflected light alone where the grid holds that).
//
// Points   area-uniform, on the side of the vertex normals; those inside solids, which nobody sees, are left out
// Sources  of the error: noise of the gathering rays (two draws at some vertices, less what interpolation takes off
// it),
//          storage (the file against what was written to it), and what is left: distance between vertices, corners that
//          count, and the blend. They are squares that sum to the relRMSE, unless the estimates alone exceed it.
// Repeat   same numbers for any thread count.   Never changes the grid

#include "core/bake/error_stats.h"
#include "core/grid/bake_grid.h"
#include "core/scene/environment.h"

namespace kiln {

struct GridSources {
  double noise = 0, storage = 0, lattice = 0;
};

struct GridCertificate {
  ErrorStats error;
  GridSources sources;
  double mean_light = 0;   // of the reference, value = irradiance / pi
  bool dark = false;       // lit by nothing: error 0 by definition
  std::size_t points = 0;  // that can be seen
  int samples = 0;         // paths a point
  std::uint64_t rays = 0;  // of the reference
  double seconds = 0;
};

struct GridCheck {
  const Grid& decoded;     // in world lengths
  const BakedGrid& baked;  // what was written
  const SphereGather::World& world;
  const GridBake& params;
  int bounces = -1;       // as baked; -1: all
  bool thorough = false;  // an error target hangs on it
};

GridCertificate certify_grid(const GridCheck&, Threads&);

}  // namespace kiln
