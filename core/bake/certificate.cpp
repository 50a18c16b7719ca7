#include "core/bake/certificate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "core/artifact/evaluate.h"
#include "core/bake/surface_samples.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/trace/reference.h"

namespace kiln {
namespace {

/// Points on the delivered surface and their places on the input's.
struct Probe {
  std::vector<TrianglePoint> delivered;
  std::vector<ReferencePoint> truth;
};

Probe probe_surface(const Mesh& delivered, const Mesh& input, const CertificateOptions& options) {
  const ClosestPoint nearest(input);
  Probe probe;
  for (const SurfaceSample& s : sample_surface(delivered, options.points, mix64(options.seed ^ 0x636572746966ULL))) {
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const auto match = nearest.query(match_position(delivered, here), match_normal(delivered, here));
    if (!match) continue;
    probe.delivered.push_back({delivered.triangles[s.triangle], s.u, s.v});
    const Vec3f face = area_vector(input, input.triangles[match->triangle]);
    const Vec3f normal = to_float(match_normal(input, *match));
    probe.truth.push_back({to_float(match_position(input, *match)), normal, normalized(face, normal)});
  }
  return probe;
}

/// A lobe max(0, w.axis)^4 about one axis, projected: positive light that no two axes share much of.
Environment lobe(const Vec3f& axis) {
  Environment map;
  map.width = 64;
  map.height = 32;
  map.radiance.clear();
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const double azimuth = ((x + 0.5) / map.width - 0.5) * 2 * M_PI,
                   elevation = (0.5 - (y + 0.5) / map.height) * M_PI;
      const Vec3d w{std::cos(elevation) * std::cos(azimuth), std::sin(elevation),
                    std::cos(elevation) * std::sin(azimuth)};
      const auto value = static_cast<float>(std::pow(std::max(0.0, dot(w, to_double(axis))), 4));
      map.radiance.push_back({value, value, value});
    }
  }
  return map;
}

struct Lightings {
  std::vector<std::string> names;
  std::vector<std::vector<Vec3f>> sh;
};

Lightings test_lightings(const BakedScene& baked) {
  Lightings out;
  const int order = baked.transfer.order;
  out.names = {"constant", "+x", "-x", "+y", "-y", "+z", "-z"};
  out.sh.push_back(project_environment(constant_sky({1, 1, 1}), order));
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0F, -1.0F}) {
      Vec3f direction;
      direction[static_cast<std::size_t>(axis)] = sign;
      out.sh.push_back(project_environment(lobe(direction), order));
    }
  }
  if (!baked.light.coefficients.empty()) {
    out.names.push_back(baked.light.name);
    out.sh.push_back(baked.light.coefficients);
  }
  return out;
}

/// The light of the lamps alone: the fixed slot under darkness.
std::vector<Vec3d> shown_values(const BakedScene& baked, const Probe& probe, const Lightings& lightings) {
  std::vector<Vec3d> out;
  const auto lamps_at = [&](const TrianglePoint& p) { return to_double(value_at(baked.transfer, p, {})); };
  for (const auto& light : lightings.sh) {
    for (const TrianglePoint& p : probe.delivered)
      out.push_back(to_double(value_at(baked.transfer, p, light)) - lamps_at(p));
  }
  if (baked.transfer.fixed) {
    for (const TrianglePoint& p : probe.delivered) out.push_back(lamps_at(p));
  }
  return out;
}

ErrorStats statistics(std::span<const Vec3d> shown, const ReferenceResult& truth, std::size_t first, std::size_t points,
                      std::uint64_t seed) {
  const std::size_t count = shown.size();
  const auto part = [&](const std::vector<Vec3d>& all) { return std::span(all).subspan(first, count); };
  const std::vector<Vec3d> noise = noise_from_halves(part(truth.half_a), part(truth.half_b));
  return compute_error({shown, part(truth.value), noise, points}, {.seed = seed});
}

}  // namespace

Certificate certify(const BakedScene& decoded, const Tracer& truth, const std::optional<Environment>& environment,
                    const CertificateOptions& options, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const Probe probe = probe_surface(decoded.scene.mesh, truth.scene().mesh, options);
  Lightings lightings = test_lightings(decoded);

  ReferenceLight light;
  if (environment) light.environments.push_back(*environment);
  light.sh_order = decoded.transfer.order;
  light.sh = lightings.sh;
  light.scene_lights = decoded.transfer.fixed;
  const ReferenceResult reference = trace_reference(
      truth, probe.truth, light,
      {.samples = options.samples, .bounces = -1, .seed = mix64(options.seed ^ 0x7472757468ULL)}, threads);

  Certificate out;
  out.points = probe.truth.size();
  out.samples = options.samples;
  const std::vector<Vec3d> shown = shown_values(decoded, probe, lightings);
  out.transport = statistics(shown, reference, light.environments.size() * out.points, out.points, options.seed);
  out.lightings = std::move(lightings.names);
  if (decoded.transfer.fixed) out.lightings.push_back("lamps");
  if (environment && environment->radiance.size() > 1) {
    const std::size_t job = lightings.sh.size() - 1;  // the job's own light stands last among the distant ones
    out.truncation =
        statistics(std::span(shown).subspan(job * out.points, out.points), reference, 0, out.points, options.seed);
  }
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
