#pragma once
// Light at points of a surface: decoded from an artefact exactly as delivered, or path-traced in a scene.
//
// A point belongs to the nearest place of the surface whose shading normal is within 90 degrees of the point's normal
// (core/mesh/closest_point.h), however far that is; a zero normal takes the nearest place of all.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "client_cli/values.h"
#include "core/artifact/baked_scene.h"
#include "core/base/threads.h"
#include "core/mesh/closest_point.h"
#include "core/scene/environment.h"

namespace kiln {

using Places = std::vector<std::optional<SurfaceMatch>>;

Places place_points(const Scene&, std::span<const QueryPoint>, Threads&);

/// irradiance = pi * value; radiance = value, or albedo * value + emission where `scene_albedo`, which towards a
/// point's own eye (`points`, where it has one) is what core/artifact/eye.h says, and emission.
struct LookupOptions {
  bool scene_albedo = false;
  std::span<const QueryPoint> points = {};  // none, or one for each place
};

/// Values under the distant light `light` (SH of the artefact's order, or empty) and the scene's own lamps.
std::vector<LightValue> artefact_values(const BakedScene&, const Places&, std::span<const Vec3f> light,
                                        const LookupOptions&);

/// The same quantity by path tracing, with standard errors from independent batches.
struct TraceOptions {
  int samples = 1024;  // paths for each point, at least 2; rounded up to fill the batches
  int bounces = -1;    // -1: all
  int sh_order = 0;    // > 0: the environment is projected to that order first
  std::uint64_t seed = 0;
  bool scene_albedo = false;
};
std::vector<LightValue> traced_values(const Scene&, const Places&, const std::optional<Environment>&,
                                      const TraceOptions&, Threads&);

/// `count` points uniform by area, with interpolated normals, in world units.
std::vector<QueryPoint> draw_points(const Scene&, std::size_t count, std::uint64_t seed);

}  // namespace kiln
