#pragma once
// The light that arrives at a place from all directions, as irradiance vectors.
//   I_d = sum over rays w_k of d's hemisphere of L(w_k) 4 pi / N w_k                                               (1)
// Indirect L is what surfaces reflect (core/meshless/lit_surface.h): a ray costs its hit and one read of a table.
// All      adds emitters and the sky, by the same rays and as many towards the emitters and the sky's bright parts,
//          joined by the balance heuristic (Veach and Guibas 1995); punctual lights exactly.
// Rays     a small and a large stratified set on the sphere, each place by a turn of its own. A place of which the
// small
//          one meets neither sky nor a surface that light is known of is inside a solid and takes no more.
// Error    that of N stratified rays and of the lit surface.   Repeat  a pure function of its arguments

#include <cstdint>
#include <optional>

#include "core/base/random.h"
#include "core/grid/grid.h"
#include "core/meshless/lit_surface.h"
#include "core/prt/direction_sets.h"
#include "core/scene/environment.h"
#include "core/trace/environment_sampler.h"
#include "core/trace/lights.h"

namespace kiln {

struct GatheredLight {
  IrradianceVectors light;
  float back = 0;  // share of the rays that met the back of a single-sided face
};

class SphereGather {
 public:
  /// What rays meet. `surface` may be null: it reflects nothing. `sky` may be null: darkness beyond the scene.
  struct World {
    const Tracer& tracer;
    const GatherFaces& faces;
    const LitSurface* surface = nullptr;
    const Environment* sky = nullptr;
  };
  /// `rays` is rounded up to a multiple of kPacket. References of the world must outlive the gather.
  SphereGather(const World&, GridContent, int rays, std::uint64_t seed);

  /// At a place in unit-cube coordinates, on no surface. `item` names it for random numbers. Adds to `rays`.
  GatheredLight at(const Vec3f& place, std::uint64_t item, std::uint64_t& rays) const;

 private:
  static constexpr int kBatch = 4;  // packets that are traced together
  static constexpr int kFewRays = kBatch * kPacket;
  /// A place in the making.
  struct Work {
    Random random;
    OctantSums sums;
    std::uint64_t& rays;
    int sent = 0, backs = 0,
        open = 0;  // rays of the sphere; open: they met the sky, or a surface that light is known of
  };
  void trace_batch(const DirectionSets&, const LocalFrame&, int first, Rays16& from, Work&) const;
  int count() const { return few_.samples() + more_.samples(); }
  Vec3f look_along(const Vec3f& w, const Hit&, Work&) const;
  Vec3f seen_sky(const Vec3f& w) const;
  Vec3f seen_emitter(const Hit&, const Vec3f& w) const;
  void add_lamps(const Vec3f& place, OctantSums&, std::uint64_t& rays) const;
  void add_bright_sky(const Vec3f& place, std::uint64_t item, OctantSums&, std::uint64_t& rays) const;
  void add_emitters(const Vec3f& place, std::uint64_t item, OctantSums&, std::uint64_t& rays) const;

  World world_;
  GridContent content_;
  std::uint64_t seed_;
  DirectionSets few_, more_;
  EmitterSampler emitters_;
  std::optional<EnvironmentSampler> bright_;  // of a map that has brighter and darker parts
};

}  // namespace kiln
