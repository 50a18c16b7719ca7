#include "client_cli/light_lookup.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/evaluate.h"
#include "core/artifact/eye.h"
#include "core/bake/eye_material.h"
#include "core/bake/field_eye.h"
#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/trace/highlights.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

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

/// What an artefact shows at a place: its lightmap, where it has one there, or its vertices.
Vec3f shown_at(const BakedScene& baked, const TrianglePoint& point, std::uint32_t triangle, const LightParts& light) {
  const Mesh& mesh = baked.scene.mesh;
  if (baked.lightmap.side == 0 || baked.lightmap.parts[mesh.part[triangle]] == 0)
    return shown_at(baked.transfer, point, light);
  const auto& [a, b, c] = point.triangle;
  return baked.lightmap.at(mesh.uv1[a] * (1 - point.u - point.v) + mesh.uv1[b] * point.u + mesh.uv1[c] * point.v);
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

/// `trace` answers ReferenceOptions with the result of one batch.
template <class Trace>
Estimates trace_batches(std::size_t points, const TraceOptions& options, const Trace& trace) {
  const int batches = std::clamp(options.samples / kSmallestBatch, 1, kBatches);
  ReferenceOptions batch;
  batch.samples = std::max(2, (options.samples + batches - 1) / batches);
  batch.bounces = options.bounces;
  batch.from = options.from;
  Estimates estimates(points);
  for (int i = 0; i < batches; ++i) {
    batch.seed = mix64(options.seed ^ (std::uint64_t{0x7265666572} << 16)) + static_cast<std::uint64_t>(i);
    const ReferenceResult result = trace(batch);
    estimates.add(result.half_a);
    estimates.add(result.half_b);
  }
  return estimates;
}

const Vec3d* view_of(const LookupOptions& options, std::size_t point) {
  if (!options.scene_albedo || point >= options.points.size() || !options.points[point].view) return nullptr;
  return &*options.points[point].view;
}

/// Points with an eye, on the surface, and what they reflect to it.
struct SeenPoints {
  std::vector<std::size_t> index;  // of the query point; ascending
  std::vector<EyedPoint> eyed;
  std::vector<Vec3d> diffuse;  // (1 - metallic) albedo (1 - E)
};

SeenPoints seen_points(const Scene& scene, const Places& places, const LookupOptions& options) {
  SeenPoints out;
  std::optional<LobeTable> lobes;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3d* view = view_of(options, i);
    if (!view || !places[i]) continue;
    if (!lobes) lobes = make_lobe_table(1);
    const EyeMaterial material = eye_material(scene, surface_at(scene, *places[i]));
    const Vec3d towards = normalized(*view);
    const double nv = dot(match_normal(scene.mesh, *places[i]), towards);
    const double kept = lobe_at(*lobes, nv, material.roughness).kept();
    out.index.push_back(i);
    out.eyed.push_back(
        {reference_point(scene, *places[i]), to_float(towards), ggx_alpha(material.roughness), material.f0});
    out.diffuse.push_back(material.diffuse * (1 - kept));
  }
  return out;
}

/// Radiance towards the eyes in place of that of an albedo.
void show_to_eyes(const Scene& scene, const Places& places, const SeenPoints& seen, const Estimates& specular,
                  std::vector<LightValue>& values) {
  for (std::size_t k = 0; k < seen.index.size(); ++k) {
    LightValue& value = values[seen.index[k]];
    const Vec3d share = seen.diffuse[k] / std::numbers::pi, error = specular.standard_error(k);
    const Vec3d below = share * value.irradiance_error;
    value.radiance = share * value.irradiance + specular.mean[k] +
                     to_double(emission_at(scene, surface_at(scene, *places[seen.index[k]])));
    value.radiance_error = {std::hypot(below.x, error.x), std::hypot(below.y, error.y), std::hypot(below.z, error.z)};
  }
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

std::vector<LightValue> artefact_values(const BakedScene& baked, const Places& places, const LightParts& light,
                                        const LookupOptions& options) {
  std::vector<LightValue> out;
  const EyeLight seen = eye_light(baked, light);
  const FieldEye field(baked);
  for (const auto& place : places) {
    if (!place) {
      out.push_back(no_value());
      continue;
    }
    const TrianglePoint point{baked.scene.mesh.triangles[place->triangle], static_cast<float>(place->u),
                              static_cast<float>(place->v)};
    const Vec3d value = to_double(shown_at(baked, point, place->triangle, light));
    out.push_back(light_value(baked.scene, *place, value, {}, options.scene_albedo));
    const Vec3d* view = view_of(options, out.size() - 1);
    if (!view) continue;
    const Vec3d normal = match_normal(baked.scene.mesh, *place);
    const SurfacePoint surface = surface_at(baked.scene, *place);
    if (!baked.field.coefficients.empty()) {
      out.back().radiance = field.seen(*place, normal, normalized(*view));
      continue;
    }
    const EyeRadiance radiance =
        eye_radiance(baked, seen, {point, normal, normalized(*view), eye_material(baked.scene, surface)});
    out.back().radiance = radiance.diffuse + radiance.specular + to_double(emission_at(baked.scene, surface));
  }
  return out;
}

std::vector<LightValue> grid_values(const Grid& grid, std::span<const QueryPoint> points) {
  std::vector<LightValue> out;
  for (const QueryPoint& p : points) {
    const double size = length(p.normal);
    if (!(size > 0)) {
      out.push_back(no_value());
      continue;
    }
    const Vec3d irradiance = to_double(irradiance_at(grid, p.position, to_float(p.normal / size)));
    out.push_back({irradiance, irradiance / std::numbers::pi, 0, {}, {}});
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
  const ReferenceLight light = reference_light(environment, options.sh_order);
  const Estimates estimates = trace_batches(points.size(), options, [&](const ReferenceOptions& batch) {
    return trace_reference(tracer, points, light, batch, threads);
  });
  std::vector<LightValue> out;
  std::size_t next = 0;
  for (const auto& place : places) {
    if (!place) {
      out.push_back(no_value());
      continue;
    }
    const Vec3d error = estimates.standard_error(next), value = estimates.mean[next++];
    out.push_back(light_value(scene, *place, value, error, options.look.scene_albedo));
  }
  const SeenPoints seen = seen_points(scene, places, options.look);
  if (seen.eyed.empty()) return out;
  const Estimates specular = trace_batches(seen.eyed.size(), options, [&](ReferenceOptions batch) {
    batch.seed = mix64(batch.seed ^ 0x6579657373ULL);  // other paths than those of the light below
    return trace_specular(tracer, seen.eyed, light, batch, threads);
  });
  show_to_eyes(scene, places, seen, specular, out);
  for (std::size_t k = 0; k < seen.index.size() && options.highlights; ++k)
    out[seen.index[k]].radiance += punctual_highlights(tracer, seen.eyed[k]);
  return out;
}

std::vector<QueryPoint> draw_points(const Scene& scene, const PointDraw& draw) {
  std::vector<QueryPoint> points;
  for (const SurfaceSample& sample : sample_surface(scene.mesh, draw.count, draw.seed, draw.density)) {
    const SurfaceMatch place{sample.triangle, sample.u, sample.v, 0};
    points.push_back({scene.frame.to_world(match_position(scene.mesh, place)), match_normal(scene.mesh, place)});
    Random random(draw.seed, points.size() - 1, 0x65796573ULL);
    if (draw.views) points.back().view = random_view(points.back().normal, random);
  }
  return points;
}

}  // namespace kiln
