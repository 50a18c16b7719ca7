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
    Vec3f face = area_vector(input, input.triangles[match->triangle]);
    const Vec3f normal = to_float(match_normal(input, *match));
    if (dot(face, normal) < 0) face = -face;
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

/// What the artefact shows under each lighting, the lamps last and alone: the fixed slot under darkness.
std::vector<Vec3d> shown_values(const BakedScene& baked, const Probe& probe, const Lightings& lightings) {
  std::vector<Vec3d> out;
  const auto lamps_at = [&](const TrianglePoint& p) { return to_double(value_at(baked.transfer, p, {})); };
  for (const auto& light : lightings.sh) {
    for (const TrianglePoint& p : probe.delivered) {
      out.push_back(to_double(value_at(baked.transfer, p, light)) - lamps_at(p));
    }
  }
  if (baked.transfer.fixed) {
    for (const TrianglePoint& p : probe.delivered) out.push_back(lamps_at(p));
  }
  return out;
}

double mean_size(std::span<const Vec3d> values) {
  double sum = 0;
  for (const Vec3d& v : values) sum += (std::abs(v.x) + std::abs(v.y) + std::abs(v.z)) / 3;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

/// The mean value of unoccluded points of all directions: the constant band of the light.
double open_value(const std::vector<Vec3f>& light) {
  return (light[0].x + light[0].y + light[0].z) / 3 * 0.28209479177387814;  // Y(0,0)
}

/// Everything known at the probed points. Index: lighting * points + point.
struct Samples {
  std::vector<Vec3d> shown, truth, noise;

  void append(const Samples& from, std::size_t first, std::size_t count) {
    const auto add = [&](std::vector<Vec3d>& to, const std::vector<Vec3d>& all) {
      to.insert(to.end(), all.begin() + static_cast<std::ptrdiff_t>(first),
                all.begin() + static_cast<std::ptrdiff_t>(first + count));
    };
    add(shown, from.shown);
    add(truth, from.truth);
    add(noise, from.noise);
  }
};

/// The lightings that matter here; the others are named in certificate.dark.
Samples judged_lightings(const Samples& all, const Lightings& lightings, bool lamps, Certificate& certificate) {
  constexpr double kDark = 0.01;
  Samples judged;
  const std::size_t points = certificate.points, count = lightings.sh.size() + (lamps ? 1 : 0);
  for (std::size_t k = 0; k < count; ++k) {
    const bool distant = k < lightings.sh.size();
    const std::string name = distant ? lightings.names[k] : "lamps";
    const double open = distant ? open_value(lightings.sh[k]) : 0;
    const double seen = std::max(mean_size(std::span(all.truth).subspan(k * points, points)),
                                 mean_size(std::span(all.shown).subspan(k * points, points)));
    if (seen <= kDark * open) {
      certificate.dark.push_back(name);
      continue;
    }
    certificate.lightings.push_back(name);
    judged.append(all, k * points, points);
  }
  return judged;
}

ErrorStats statistics(const Samples& samples, std::size_t points, std::uint64_t seed) {
  return compute_error({samples.shown, samples.truth, samples.noise, points}, {.seed = seed});
}

/// Paths a point for a share of the bake's rays. A few pilot paths tell how many rays a path takes here: 2 on a bunny
/// under the sky, 40 in a white room. A function of the scene alone, so that reports repeat.
int affordable_samples(const Tracer& truth, const Probe& probe, const ReferenceLight& light,
                       const CertificateOptions& options, Threads& threads) {
  constexpr double kShare = 0.05, kSingleRay = 6;  // a ray of a path costs six of a packet: measured on the scenes
  constexpr int kPilot = 8;
  const ReferenceResult pilot = trace_reference(truth, probe.truth, light, {.samples = kPilot}, threads);
  const double per_sample = static_cast<double>(std::max<std::uint64_t>(pilot.rays, 1)) / kPilot;  // of all points
  return static_cast<int>(
      std::clamp(kShare * static_cast<double>(options.bake_rays) / (kSingleRay * per_sample), 256.0, 4096.0));
}

}  // namespace

Certificate certify(const BakedScene& decoded, const Tracer& truth, const std::optional<Environment>& environment,
                    const CertificateOptions& options, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const Probe probe = probe_surface(decoded.scene.mesh, truth.scene().mesh, options);
  const Lightings lightings = test_lightings(decoded);

  ReferenceLight light;
  if (environment) light.environments.push_back(*environment);
  light.sh_order = decoded.transfer.order;
  light.sh = lightings.sh;
  light.scene_lights = decoded.transfer.fixed;
  const int samples = affordable_samples(truth, probe, light, options, threads);
  const ReferenceResult reference =
      trace_reference(truth, probe.truth, light,
                      {.samples = samples, .bounces = -1, .seed = mix64(options.seed ^ 0x7472757468ULL)}, threads);

  Certificate out;
  out.points = probe.truth.size();
  out.samples = samples;
  const Samples full{{}, reference.value, noise_from_halves(reference.half_a, reference.half_b)};
  Samples all{shown_values(decoded, probe, lightings), {}, {}};
  const std::size_t skipped = light.environments.size() * out.points;
  all.truth.assign(full.truth.begin() + static_cast<std::ptrdiff_t>(skipped), full.truth.end());
  all.noise.assign(full.noise.begin() + static_cast<std::ptrdiff_t>(skipped), full.noise.end());
  out.transport = statistics(judged_lightings(all, lightings, light.scene_lights, out), out.points, options.seed);
  if (environment && environment->radiance.size() > 1) {
    const std::size_t job = (lightings.sh.size() - 1) * out.points;  // the job's own light is the last distant one
    Samples sky;
    sky.shown.assign(all.shown.begin() + static_cast<std::ptrdiff_t>(job),
                     all.shown.begin() + static_cast<std::ptrdiff_t>(job + out.points));
    sky.truth.assign(full.truth.begin(), full.truth.begin() + static_cast<std::ptrdiff_t>(out.points));
    sky.noise.assign(full.noise.begin(), full.noise.begin() + static_cast<std::ptrdiff_t>(out.points));
    out.truncation = statistics(sky, out.points, options.seed);
  }
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
