#pragma once
// Direct light of the scene's own lamps at a point: punctual lights and emitting triangles.
//
// Emitters are taken twice and joined by the balance heuristic (Veach and Guibas 1995): points on them in proportion
// to area and strength, and cosine-distributed rays that happen to hit one. The first finds small lamps, the second
// keeps the estimate bounded where a point nearly touches a lamp.
//   value = irradiance / pi = sum over all samples of L_e (cos / pi) / (N_area p_area + N_cos cos / pi)
// Units   W m^-2 sr^-1.   Error   unbiased

#include <cstdint>

#include "core/base/vec.h"
#include "core/trace/lights.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Where light is received: an origin already lifted off the surface, and the unit normal.
struct Receiver {
  Vec3f origin, normal;
};

/// Cosine rays beside each point on an emitter.
constexpr int cosine_share(int samples) { return (samples + 3) / 4; }

class Lamps {
 public:
  /// Keeps references to the tracer and its scene.
  explicit Lamps(const Tracer& tracer) : tracer_(tracer), emitters_(tracer.scene()) {}

  bool none() const { return emitters_.empty() && tracer_.scene().lights.empty(); }
  bool has_emitters() const { return !emitters_.empty(); }

  /// Irradiance / pi from the punctual lights, or one of them: one shadow ray each.
  Vec3f punctual(const Receiver&) const;
  Vec3f punctual(const Receiver&, const Light&) const;
  /// Irradiance / pi from the emitters: `samples` points on them and cosine_share(samples) rays.
  Vec3f emitted(const Receiver&, int samples, std::uint64_t seed) const;
  /// Radiance that leaves an emitter against a ray that hits it.
  Vec3f emission(std::uint32_t triangle, float u, float v, const Vec3f& direction) const;

 private:
  struct Shares {
    double area, cosine;  // numbers of samples of each kind
  };
  Vec3d from_points(const Receiver&, const Shares&, std::uint64_t seed) const;
  Vec3d from_rays(const Receiver&, const Shares&, std::uint64_t seed) const;

  const Tracer& tracer_;
  EmitterSampler emitters_;
};

}  // namespace kiln
