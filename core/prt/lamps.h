#pragma once
// Direct light of the scene's own lamps at a point: punctual lights and emitting triangles.
//
// Emitters are taken twice and joined by the balance heuristic (Veach and Guibas 1995): points on them in proportion
// to area and strength, and cosine-distributed rays that happen to hit one. The first finds small lamps, the second
// keeps the estimate bounded where a point nearly touches a lamp.
//   value = irradiance / pi = 1 / N_area sum over all samples of L_e (cos / pi) / (p_area + N_cos / N_area cos / pi)
// Rounds  of a quarter, a quarter, a half, one, two, ... times `samples`, from the third on until estimates differ so
//         little from those of the rounds before that the error is likely below the tolerance, as transfer vectors do
//         (direct_transfer.h): a few points that nearly touch a lamp have most of the noise. Of two differences the
//         larger counts, the earlier by a half: one is small by chance at every fourth such point.
// Units   W m^-2 sr^-1.   Error   unbiased without a tolerance

#include <cstdint>

#include "core/base/vec.h"
#include "core/sphere/sobol_points.h"
#include "core/trace/lights.h"
#include "core/trace/surface.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Where light is received: an origin already lifted off the surface, and the unit normal.
struct Receiver {
  Vec3f origin, normal;
};

/// Points on emitters, and cosine-distributed rays beside them.
struct EmitterRays {
  int samples = 256;    // a multiple of 16 where reach is above 1
  int reach = 1;        // at most so many times as many
  float tolerance = 0;  // of irradiance / pi
};
constexpr int cosine_share(int samples) { return (samples + 3) / 4; }

class Lamps {
 public:
  /// Keeps references to the tracer and its scene.
  explicit Lamps(const Tracer& tracer) : tracer_(tracer), emitters_(tracer.emitters()) {}

  bool none() const { return emitters_.empty() && tracer_.scene().lights.empty(); }
  bool has_emitters() const { return !emitters_.empty(); }

  /// Irradiance / pi from the punctual lights, or one of them: one shadow ray each.
  Vec3f punctual(const Receiver&) const;
  Vec3f punctual(const Receiver&, const Light&) const;
  /// Irradiance / pi from the emitters: points on them and cosine_share of as many rays. Adds what was sent to
  /// `rays`: a point that cannot bring light costs none.
  Vec3f emitted(const Receiver&, const EmitterRays&, std::uint64_t seed, std::uint64_t& rays) const;
  /// Radiance that leaves an emitter against a ray that hits it.
  Vec3f emission(std::uint32_t triangle, float u, float v, const Vec3f& direction) const;

 private:
  struct Round {
    int first, last;  // samples, of one kind
    double cosine;    // rays for each point on an emitter
  };
  Vec3d from_points(const Receiver&, const Round&, const SobolPoints&, std::uint64_t& sent) const;
  Vec3d from_rays(const Receiver&, const Round&, const SobolPoints&) const;
  Vec3f emission(const SurfacePoint&, const Vec3f& direction) const;

  const Tracer& tracer_;
  const EmitterSampler& emitters_;
};

}  // namespace kiln
