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
#include "core/grid/grid.h"
#include "core/mesh/closest_point.h"
#include "core/scene/environment.h"

namespace kiln {

using Places = std::vector<std::optional<SurfaceMatch>>;

Places place_points(const Scene&, std::span<const QueryPoint>, Threads&);

/// irradiance = pi * value; radiance = value, or albedo * value + emission where `scene_albedo`. Towards a point's own
/// eye
/// (`points`, where it has one) that is instead
///   (1 - metallic) albedo (1 - E) value + specular + emission                                                     (1)
/// as core/artifact/eye.h says; of an artefact only where it has matrices, as everything else in it is diffuse, and of
/// a light field what that shows (core/lightfield/seen.h), under the light it was baked with.
struct LookupOptions {
  bool scene_albedo = false;
  std::span<const QueryPoint> points = {};  // none, or one for each place
};

/// Values under the distant light `light` (SH of the artefact's order, or empty) and the scene's own lamps; where the
/// scene has a lightmap, those of that.
std::vector<LightValue> artefact_values(const BakedScene&, const Places&, const LightParts& light,
                                        const LookupOptions&);

/// What a grid says of receivers in space: no surface is asked for, albedo is 1, distance 0. A zero normal has no
/// value.
std::vector<LightValue> grid_values(const Grid&, std::span<const QueryPoint>);

/// The same quantity by path tracing, with standard errors from independent batches. Towards an eye it is equation 1 of
/// whatever surface: the first reflection has its GGX lobe, later ones are diffuse (core/trace/reference.h).
struct TraceOptions {
  int samples = 1024;  // paths for each point, at least 2; rounded up to fill the batches
  int bounces = -1;    // -1: all
  int from = 0;        // reflections that light must have made; 1: no direct light
  int sh_order = 0;    // > 0: the environment is projected to that order first
  std::uint64_t seed = 0;
  bool highlights = false;  // of punctual lights, towards eyes: a light field holds them, matrices do not
  LookupOptions look = {};
};
std::vector<LightValue> traced_values(const Scene&, const Places&, const std::optional<Environment>&,
                                      const TraceOptions&, Threads&);

/// `count` points uniform by area, with interpolated normals, in world units. `views`: each with an eye in a random
/// direction, even over the half space of its normal. `density`: see surface_samples.h.
struct PointDraw {
  std::size_t count = 0;
  std::uint64_t seed = 0;
  bool views = false;
  std::span<const double> density = {};
};
std::vector<QueryPoint> draw_points(const Scene&, const PointDraw&);

}  // namespace kiln
