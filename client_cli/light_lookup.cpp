#include "client_cli/light_lookup.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/evaluate.h"
#include "core/artifact/eye.h"
#include "core/bake/eye_material.h"
#include "core/bake/surface_samples.h"
#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr std::size_t kPointBlock = 256;
constexpr int kBatches = 8;         // independent runs, two halves each: 15 degrees of freedom for the standard error
constexpr int kSmallestBatch = 16;  // samples; fewer would take stratification away

SurfacePoint surface_at(const Scene& scene, const SurfaceMatch& place) {
  return surface_point(scene, place.triangle, static_cast<float>(place.u), static_cast<float>(place.v));
}

/// Value and its standard error become irradiance and radiance.
LightValue light_value(const Scene& scene, const SurfaceMatch& place, const Vec3d& value, const Vec3d& error,
                       bool scene_albedo) {
  Vec3d albedo{1, 1, 1}, emission;
  if (scene_albedo) {
    const SurfacePoint surface = surface_at(scene, place);
    albedo = to_double(albedo_at(scene, surface));
    emission = to_double(emission_at(scene, surface));
  }
  return {value * std::numbers::pi, albedo * value + emission, place.distance * scene.frame.scale,
          error * std::numbers::pi, albedo * error};
}

/// The side of the face on which the shading normal lies is the side that is lit.
ReferencePoint reference_point(const Scene& scene, const SurfaceMatch& place) {
  const Vec3f normal = to_float(match_normal(scene.mesh, place));
  const Vec3f face = normalized(area_vector(scene.mesh, scene.mesh.triangles[place.triangle]), normal);
  return {to_float(match_position(scene.mesh, place)), normal, dot(face, normal) < 0 ? -face : face};
}

ReferenceLight reference_light(const std::optional<Environment>& environment, int sh_order) {
  ReferenceLight light;
  light.scene_lights = true;
  if (!environment) return light;
  if (sh_order > 0) {
    light.sh_order = sh_order;
    light.sh.push_back(project_environment(*environment, sh_order));
  } else {
    light.environments.push_back(*environment);
  }
  return light;
}

/// Running mean and spread of independent estimates (Welford 1962).
struct Estimates {
  std::vector<Vec3d> mean, spread;
  double count = 0;

  explicit Estimates(std::size_t points) : mean(points), spread(points) {}

  /// Adds one estimate for each point: the sum over lightings of values[lighting * points + point].
  void add(const std::vector<Vec3d>& values) {
    count += 1;
    for (std::size_t i = 0; i < mean.size(); ++i) {
      Vec3d sum;
      for (std::size_t place = i; place < values.size(); place += mean.size()) sum += values[place];
      const Vec3d before = sum - mean[i];
      mean[i] += before / count;
      spread[i] += before * (sum - mean[i]);
    }
  }

  Vec3d standard_error(std::size_t i) const {
    const double scale = 1 / (count * (count - 1));
    return {std::sqrt(spread[i].x * scale), std::sqrt(spread[i].y * scale), std::sqrt(spread[i].z * scale)};
  }
};

Estimates trace_batches(const Tracer& tracer, std::span<const ReferencePoint> points, const ReferenceLight& light,
                        const TraceOptions& options, Threads& threads) {
  const int batches = std::clamp(options.samples / kSmallestBatch, 1, kBatches);
  ReferenceOptions batch;
  batch.samples = std::max(2, (options.samples + batches - 1) / batches);
  batch.bounces = options.bounces;
  Estimates estimates(points.size());
  for (int i = 0; i < batches; ++i) {
    batch.seed = mix64(options.seed ^ (std::uint64_t{0x7265666572} << 16)) + static_cast<std::uint64_t>(i);
    const ReferenceResult result = trace_reference(tracer, points, light, batch, threads);
    estimates.add(result.half_a);
    estimates.add(result.half_b);
  }
  return estimates;
}

}  // namespace

Places place_points(const Scene& scene, std::span<const QueryPoint> points, Threads& threads) {
  const ClosestPoint closest(scene.mesh);
  Places places(points.size());
  threads.for_blocks(points.size(), kPointBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      places[i] = closest.query(scene.frame.to_unit(points[i].position), points[i].normal);
  });
  return places;
}

std::vector<LightValue> artefact_values(const BakedScene& baked, const Places& places, std::span<const Vec3f> light,
                                        const LookupOptions& options) {
  std::vector<LightValue> out;
  const EyeLight seen = eye_light(baked, {light.begin(), light.end()}, true);
  for (const auto& place : places) {
    if (!place) {
      out.push_back(no_value());
      continue;
    }
    const TrianglePoint point{baked.scene.mesh.triangles[place->triangle], static_cast<float>(place->u),
                              static_cast<float>(place->v)};
    const Vec3d value = to_double(value_at(baked.transfer, point, light));
    out.push_back(light_value(baked.scene, *place, value, {}, options.scene_albedo));
    const std::size_t index = out.size() - 1;
    if (!options.scene_albedo || index >= options.points.size() || !options.points[index].view) continue;
    const SurfacePoint surface = surface_at(baked.scene, *place);
    const EyeRadiance radiance =
        eye_radiance(baked, seen,
                     {point, match_normal(baked.scene.mesh, *place), normalized(*options.points[index].view),
                      eye_material(baked.scene, surface)});
    out.back().radiance = radiance.diffuse + radiance.specular + to_double(emission_at(baked.scene, surface));
  }
  return out;
}

std::vector<LightValue> traced_values(const Scene& scene, const Places& places,
                                      const std::optional<Environment>& environment, const TraceOptions& options,
                                      Threads& threads) {
  EXPECTS(options.samples >= 2);
  std::vector<ReferencePoint> points;
  for (const auto& place : places) {
    if (place) points.push_back(reference_point(scene, *place));
  }
  const Tracer tracer(scene, threads);
  const Estimates estimates =
      trace_batches(tracer, points, reference_light(environment, options.sh_order), options, threads);
  std::vector<LightValue> out;
  std::size_t next = 0;
  for (const auto& place : places) {
    if (!place) {
      out.push_back(no_value());
      continue;
    }
    const Vec3d error = estimates.standard_error(next), value = estimates.mean[next++];
    out.push_back(light_value(scene, *place, value, error, options.scene_albedo));
  }
  return out;
}

std::vector<QueryPoint> draw_points(const Scene& scene, std::size_t count, std::uint64_t seed) {
  std::vector<QueryPoint> points;
  for (const SurfaceSample& sample : sample_surface(scene.mesh, count, seed)) {
    const SurfaceMatch place{sample.triangle, sample.u, sample.v, 0};
    points.push_back({scene.frame.to_world(match_position(scene.mesh, place)), match_normal(scene.mesh, place)});
  }
  return points;
}

}  // namespace kiln
