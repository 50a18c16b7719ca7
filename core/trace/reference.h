#pragma once
// The brute-force truth: a unidirectional path estimator in the simplest form that can be right.
//
//   value(x, n) = irradiance / pi = radiance that leaves a white Lambertian point
//               = 1/pi * integral over the hemisphere of n of L(x, w) (n.w) dw
// Paper   Kajiya 1986.   Units  W m^-2 sr^-1.   Repeat  same bits for any thread count.
// Method  cosine-distributed paths; at each vertex one more ray to each environment map that is not constant, joined
//         with the path's own by the balance heuristic (Veach and Guibas 1995), and what lamps bring (lamp_light.h).
//         A path ends at the back of a single-sided face, which is black.
// Cost    points x samples x path length closest-hit rays, and the rays above.
// Error   unbiased up to `bounces` (albedos are limited to 0.999, as everywhere in Kiln); standard error from the two
//         halves of the samples.
// Simple  double accumulation, no adaptivity, no reuse, no clamping; the first directions of a point are stratified.

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/base/vec.h"
#include "core/scene/environment.h"
#include "core/trace/tracer.h"

namespace kiln {

struct ReferencePoint {
  Vec3f position;  // unit-cube coordinates, on the surface; the estimator offsets it along `face_normal`
  Vec3f normal;    // shading normal
  Vec3f face_normal;
};

/// Distant light for the estimator: full-detail environments, or environments projected to SH (may be negative).
struct ReferenceLight {
  std::vector<Environment> environments;  // each is one lighting
  int sh_order = 0;                       // > 0: `sh` holds further lightings, one per entry
  std::vector<std::vector<Vec3f>> sh;     // [lighting][sh_count(sh_order)]
  std::vector<Light> lamps;               // each is one more lighting: a punctual light of its own
  bool scene_lights = false;              // one more lighting, last: emitters and punctual lights of the scene
};

struct ReferenceOptions {
  int samples = 1024;  // per point; rounded up to an even number
  int bounces = -1;    // -1: until Russian roulette ends the path (unbiased); 0: direct only
  int from = 0;        // reflections that light must have made to count: 1 leaves direct light out
  std::uint64_t seed = 0;
};

/// All lightings are estimated along the same paths. Index: lighting * points + point.
struct ReferenceResult {
  std::vector<Vec3d> value;           // mean of both halves
  std::vector<Vec3d> half_a, half_b;  // independent halves (even and odd samples)
  std::uint64_t rays = 0;             // at most: one path ray at each vertex, and one to each light it may look for
};

ReferenceResult trace_reference(const Tracer&, std::span<const ReferencePoint>, const ReferenceLight&,
                                const ReferenceOptions&, Threads&);

/// A point seen by an eye, and what it is made of (core/trace/ggx.h).
struct EyedPoint {
  ReferencePoint at;
  Vec3f view;  // unit, towards the eye
  double alpha = 1;
  Vec3d f0;
};

/// Radiance that the GGX lobe of each point sends to its eye: as above, but the first reflection is specular and the
/// value is
///   integral over the hemisphere of n of L(x, w) f(view, w) (n.w) dw,  f of ggx.h
/// All later reflections are diffuse. The last lighting is what the lobe shows of emitters and of surfaces that lamps
/// light; the highlights of punctual lights themselves are left out.
/// Method  visible normals drawn, and one ray to each environment map, joined by the balance heuristic; emitters are
///         found by the path alone.
ReferenceResult trace_specular(const Tracer&, std::span<const EyedPoint>, const ReferenceLight&,
                               const ReferenceOptions&, Threads&);

/// The same, but with a kernel of few bands in place of the lobe:
///   integral over the hemisphere of n of L(x, w) K(w) dw,   K(w) = sum_i kernel_i Y_i(w)
/// kernel[point] has order^2 numbers in world axes, 1 <= order <= kMaxShOrder; the points' lobes only say where most
/// directions are drawn. What is seen past the view's horizon is 0, as above.
struct KernelPoints {
  std::span<const EyedPoint> eyed;
  std::span<const std::vector<double>> kernel;  // same size
};
ReferenceResult trace_kernels(const Tracer&, const KernelPoints&, const ReferenceLight&, const ReferenceOptions&,
                              Threads&);

}  // namespace kiln
