#pragma once
// Radiance that leaves the vertices of a scene towards every eye, as r-RFs (light_field.h).
//   L(p, v) = emission + below (1 - E(n.v)) value + integral of L(p, l) f(l, v) (n.l) dl                            (1)
// value: diffuse light of the vertex, given (radiosity, or any other); below: reflectance of the diffuse layer. f is
// glTF's GGX lobe (core/trace/ggx.h). What arrives is traced once for each vertex and fitted for all eyes
// (lobe_fits.h): rays even over the half space, and what they would find badly beside them
// (core/meshless/incident_light.h). Where the sky is kept apart, rays bring what differs from the sky behind what the
// vertex sees of it; where lamps are kept apart, they bring nothing of these.
// Paper   Vanhoey et al. 2015, whose input was fitted to photographs.
// Units   W m^-2 sr^-1; lengths of the unit cube.
// Error   that of the rays (`noise`) and of the fit; unbiased but for the lit surface that rays look at
// Cost    vertices x rays closest-hit rays, twice that where a sky has bright parts or the scene emitters
// Repeat  same bits for any thread count.   Fails  never on a valid Scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <span>

#include "core/base/threads.h"
#include "core/lightfield/mirrored_sky.h"
#include "core/meshless/incident_light.h"

namespace kiln {

struct OutgoingBake {
  int degree = 4;   // 0 .. kMaxLightFieldDegree
  int rays = 1024;  // of a vertex; rounded up to a multiple of 128
  std::uint64_t seed = 0;
  /// Keeps the sky apart where a vertex is smooth (share_apart, light_field.h, mirrored_sky.h).
  bool sky_apart = false;
  /// Keeps punctual lamps apart (lamp_highlights.h), the kMostFieldLamps brightest of them, at all vertices.
  bool lamps_apart = false;
  /// Leaves what the surface emits to its materials.
  bool emission_apart = false;
  /// Leaves the colours of the diffuse layer to them: the field has `value` itself.
  bool diffuse_apart = false;
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};  // vertices
};

struct OutgoingLight {
  LightField field;  // of the vertices
  SkyLevels sky;     // where the field keeps it apart
  double noise = 0;  // of the rays: root mean square over vertices (by area), eyes and channels, relative to the mean
  std::uint64_t rays = 0;
};

/// How much of the sky is kept apart at a roughness: all of it to .45, nothing from .65 on, where series hold it as
/// well.
double share_apart(double roughness);

/// The surface that sends: the world's, or one that was split from it, with the light of each vertex.
struct LitVertices {
  const Scene& scene;
  std::span<const Vec3f> value;
};

OutgoingLight bake_outgoing(const IncidentLight::World&, const LitVertices&, const OutgoingBake&, Threads&);

}  // namespace kiln
