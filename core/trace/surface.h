#pragma once
// What a ray finds where it lands.

#include "core/base/vec.h"
#include "core/scene/scene.h"
#include "core/scene/texture.h"
#include "core/trace/tracer.h"

namespace kiln {

struct SurfacePoint {
  Vec3f position;          // on the face, not offset
  Vec3f geometric_normal;  // of the face, by winding
  Vec3f normal;            // interpolated vertex normal, unit; in the half space of geometric_normal
  std::uint32_t triangle = 0;
  float u = 0, v = 0;
};

SurfacePoint surface_point(const Scene&, std::uint32_t triangle, float u, float v);

/// Linear reflectance at a point: base colour factor x texture x vertex colour, clamped to [0, 0.999].
/// Light on its way between surfaces finds each of them Lambertian with this albedo (metals too: their reflectance is
/// kept, its direction is not).
Vec3f albedo_at(const Scene&, const SurfacePoint&);
/// Metallic and roughness factor x texture (blue and green, linear), each limited to [0, 1].
struct SurfaceFinish {
  float metallic = 0, roughness = 1;
};
SurfaceFinish finish_at(const Scene&, const SurfacePoint&);
/// Emitted radiance of the front face. The back of a double-sided material emits the same, that of others nothing:
/// the caller knows from which side it looks.
Vec3f emission_at(const Scene&, const SurfacePoint&);
/// Coverage: 1 unless the material's alpha mode is mask (0 or 1) or blend.
float opacity_at(const Scene&, const SurfacePoint&);
/// The coverage from which a surface stops rays.
inline constexpr float kOpaqueFrom = 0.5F;

}  // namespace kiln
