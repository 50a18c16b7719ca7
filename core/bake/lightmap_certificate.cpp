#include "core/bake/lightmap_certificate.h"

#include <chrono>
#include <cmath>

#include "core/bake/second_look.h"
#include "core/bake/spending.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/hidden.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

/// Points that can be seen: their coordinates in the lightmap, and their places on the true surface.
struct Probe {
  std::vector<Vec2f> uv;
  std::vector<ReferencePoint> truth;
};

class Prober {
 public:
  explicit Prober(const LightmapCheck& check)
      : mesh_(check.decoded.scene.mesh),
        input_(check.truth.scene().mesh),
        nearest_(input_),
        hidden_(hidden_test(check.truth)) {
    for (const std::uint32_t part : mesh_.part) density_.push_back(check.lightmap.parts[part] != 0 ? 1 : 0);
  }

  Probe probe(std::size_t count, std::uint64_t seed) const {
    Probe out;
    for (const SurfaceSample& s : sample_surface(mesh_, count, mix64(seed ^ 0x6c6d63657274ULL), density_)) {
      const SurfaceMatch here{s.triangle, s.u, s.v, 0};
      const auto match = nearest_.query(match_position(mesh_, here), match_normal(mesh_, here));
      if (!match) continue;
      const Vec3f position = to_float(match_position(input_, *match)), normal = to_float(match_normal(input_, *match));
      Vec3f face = normalized(area_vector(input_, input_.triangles[match->triangle]), normal);
      if (dot(face, normal) < 0) face = -face;
      if (hidden_({position, normal, position, face})) continue;
      const Triangle& t = mesh_.triangles[s.triangle];
      out.uv.push_back(mesh_.uv1[t[0]] * (1 - s.u - s.v) + mesh_.uv1[t[1]] * s.u + mesh_.uv1[t[2]] * s.v);
      out.truth.push_back({position, normal, face});
    }
    return out;
  }

 private:
  const Mesh &mesh_, &input_;
  ClosestPoint nearest_;
  HiddenTest hidden_;
  std::vector<double> density_;
};

/// The job's environment and the scene's lamps together.
struct Truth {
  std::vector<Vec3d> value, noise;
  std::uint64_t rays = 0;
};

double mean_size(const std::vector<Vec3d>& values) {
  double sum = 0;
  for (const Vec3d& x : values) sum += (std::abs(x.x) + std::abs(x.y) + std::abs(x.z)) / 3;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

std::vector<Vec3d> shown(const Lightmap& map, const Probe& probe) {
  std::vector<Vec3d> out;
  for (const Vec2f& uv : probe.uv) out.push_back(to_double(map.at(uv)));
  return out;
}

Truth truth_at(const LightmapCheck& check, std::span<const ReferencePoint> points, int samples, std::uint64_t seed,
               Threads& threads) {
  if (points.empty()) return {};
  ReferenceLight light;
  light.scene_lights = true;
  if (check.sky != nullptr) light.environments.push_back(*check.sky);
  const ReferenceOptions options{.samples = samples, .bounces = check.bounces, .seed = seed};
  const ReferenceResult r = trace_reference(check.truth, points, light, options, threads);
  const auto together = [&](const std::vector<Vec3d>& all) {
    std::vector<Vec3d> sum(points.size());
    for (std::size_t i = 0; i < all.size(); ++i) sum[i % points.size()] += all[i];
    return sum;
  };
  return {together(r.value), noise_from_halves(together(r.half_a), together(r.half_b)), r.rays};
}

/// See second_look.h.
void look_again(const LightmapCheck& check, const Probe& probe, const std::vector<Vec3d>& values, int samples,
                std::uint64_t seed, Truth& truth, Threads& threads) {
  std::vector<double> doubt;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Vec3d off = values[i] - truth.value[i], &noise = truth.noise[i];
    doubt.push_back(dot(off, off) + noise.x + noise.y + noise.z);
  }
  const std::vector<std::size_t> chosen = doubtful_points(doubt);
  std::vector<ReferencePoint> again;
  for (const std::size_t p : chosen) again.push_back(probe.truth[p]);
  const Truth known = truth_at(check, again, kMorePaths * samples, mix64(seed ^ 0x616761696eULL), threads);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    truth.value[chosen[i]] = known.value[i], truth.noise[chosen[i]] = known.noise[i];
  truth.rays += known.rays;
}

}  // namespace

LightmapCertificate certify_lightmap(const LightmapCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t seed = mix64(check.seed ^ 0x6c6d7472757468ULL);
  const Prober prober(check);

  const Probe few = prober.probe(Spending::kFewestPoints, seed);
  const Truth pilot = truth_at(check, few.truth, Spending::kPilotSamples, mix64(seed), threads);
  const std::vector<Vec3d> first = shown(check.lightmap, few);
  const ErrorStats known =
      compute_error({first, pilot.value, pilot.noise, few.uv.size()}, {.seed = seed, .resamples = 1});
  const double paths = static_cast<double>(std::max<std::size_t>(few.uv.size(), 1)) * Spending::kPilotSamples;
  const Spending spending =
      plan_spending(known, std::max(1.0, static_cast<double>(pilot.rays) / paths), check.bake_rays, false);

  const Probe many = prober.probe(spending.points, seed);
  Truth truth = truth_at(check, many.truth, spending.samples, seed, threads);
  const std::vector<Vec3d> values = shown(check.lightmap, many), of_image = shown(check.image, many);
  look_again(check, many, values, spending.samples, seed, truth, threads);
  LightmapCertificate out;
  out.points = many.uv.size();
  out.samples = spending.samples;
  out.rays = pilot.rays + truth.rays;
  out.mean_light = mean_size(truth.value);
  out.dark = !(out.mean_light > 0) && !(mean_size(values) > 0);
  out.error = compute_error({values, truth.value, truth.noise, out.points}, {.seed = seed});
  out.image = compute_error({of_image, truth.value, truth.noise, out.points}, {.seed = seed});
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
