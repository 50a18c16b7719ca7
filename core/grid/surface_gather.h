#pragma once
// The light that arrives at places of a surface, as receivers there have it: what a grid should say of them.
//   E = pi / N sum over N cosine rays of the light that the surface they land on reflects                           (1)
// Units   W m^-2.   Error  that of N stratified rays and of the lit surface.   Repeat  a pure function of its arguments

#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/grid/sphere_gather.h"
#include "core/prt/lamps.h"

namespace kiln {

class SurfaceGather {
 public:
  /// `rays` is rounded up to a multiple of kPacket. References of the world must outlive the gather.
  SurfaceGather(const SphereGather::World&, int rays, std::uint64_t seed);

  /// Equation 1 for a receiver that is off the surface by a hair. `item` names it for random numbers. Adds to `rays`.
  Vec3f at(const Receiver&, std::uint64_t item, std::uint64_t& rays) const;

 private:
  SphereGather::World world_;
  std::uint64_t seed_;
  DirectionSets sets_;
};

struct SurfacePlace {
  Vec3f position, normal;  // unit cube
  Vec3f light;             // equation 1
};

struct SurfacePlaces {
  double per_face = 8;  // to the area of a cell's smallest face
  int rays = 256;       // of a place
  std::uint64_t seed = 0;
};

/// Places even over the surface, both sides of it where faces are double-sided. Left out are those inside solids and
/// those that see none of the corners that count for them: they read light that is not theirs to change.
/// `stands` is where each vertex of the grid gathered (gather_places).   Same bits for any thread count
std::vector<SurfacePlace> gather_surface(const SphereGather::World&, const SurfacePlaces&, const Grid&,
                                         const std::vector<Vec3f>& stands, std::uint64_t& rays, Threads&);

}  // namespace kiln
