#pragma once
// The light that arrives at a place from all directions, as irradiance vectors.
//   I_d = sum over rays w_k of d's hemisphere of L(w_k) 4 pi / N w_k                                               (1)
// Indirect L is what surfaces reflect (core/meshless/lit_surface.h): a ray costs its hit and one read of a table.
// All      adds the light of lamps and sky as well (core/meshless/incident_light.h).
// Rays     a stratified set on the sphere, each place by a turn of its own, along a curve so that packets are narrow;
//          the last packet goes first and looks everywhere. A place of which it and a batch more meet neither sky nor a
//          surface that light is known of is inside a solid and takes no more.
// Error    that of N stratified rays and of the lit surface.   Repeat  a pure function of its arguments

#include <array>
#include <cstdint>

#include "core/base/random.h"
#include "core/grid/grid.h"
#include "core/meshless/incident_light.h"
#include "core/prt/direction_sets.h"

namespace kiln {

struct GatheredLight {
  IrradianceVectors light;
  float back = 0;  // share of the rays that met the back of a single-sided face
};

class SphereGather {
 public:
  using World = IncidentLight::World;
  /// `rays` is rounded up to a multiple of kPacket. References of the world must outlive the gather.
  SphereGather(const World&, GridContent, int rays, std::uint64_t seed);

  /// At a place in unit-cube coordinates, on no surface. `item` names it for random numbers. Adds to `rays`.
  GatheredLight at(const Vec3f& place, std::uint64_t item, std::uint64_t& rays) const;

 private:
  static constexpr int kBatch = 4;  // packets that are traced together
  /// A place in the making.
  struct Work {
    Random random;
    OctantSums sums;
    std::uint64_t& rays;
    int sent = 0, backs = 0;  // rays of the sphere
    int open = 0;             // of them: met the sky, or a surface that light is known of
  };
  using Batch = std::array<Rays16, kBatch>;
  void trace_batch(const LocalFrame&, int first, Batch&, Work&) const;

  std::uint64_t seed_;
  DirectionSets sets_;
  IncidentLight light_;
};

}  // namespace kiln
